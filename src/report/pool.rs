//! Images in memory and in the store, and which of them serve the show.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::document::headline;
use super::words::{count, megabytes, qualities};
use footlight_engine::pool::Pool;
use footlight_engine::{Engine, Freed, PoolSummary, StoreSummary};
use footlight_transport::Quality;

/// Images in memory and in the store.
pub fn describe(engine: &Engine) -> String {
    let mut text = headline(engine.document()) + "\n";
    let summary = PoolSummary::of(engine);
    match (engine.estimate().pool(), &summary) {
        (Some(pool), Some(summary)) => describe_images(&mut text, engine, pool, summary),
        _ => {
            let refined = count(engine.estimate().refined(), "refined picture");
            let _ = writeln!(text, "no coarse pictures in memory yet; {refined}");
        }
    }
    let Some(summary) = summary else {
        return text;
    };
    if summary.idle > 0 {
        let idle = count(summary.idle, "picture");
        let _ = writeln!(text, "{idle} kept that an edit put aside");
    }
    match &summary.store {
        None => text.push_str("no store: pictures are kept until you leave\n"),
        Some(store) => describe_store(&mut text, store),
    }
    text
}

fn describe_images(text: &mut String, engine: &Engine, pool: &Pool, summary: &PoolSummary) {
    let (width, height) = pool.size();
    let bytes = summary.held * width * height * 12;
    let _ = writeln!(
        text,
        "in memory: {} {}, {}, {width}x{height}, {}",
        count(pool.coarse().len(), "coarse picture"),
        qualities(engine),
        count(pool.refined().len(), "refined picture"),
        megabytes(bytes as u64)
    );
    let names = engine.show().coordinates();
    for (i, refined) in pool.refined().iter().enumerate() {
        let lit = names.iter().zip(&refined.setting);
        let mut lit: Vec<_> = lit.filter(|(_, s)| **s != 0.0).collect();
        lit.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let first = lit
            .iter()
            .take(3)
            .map(|(c, s)| format!("{} {s:.2}", c.name));
        let first: Vec<String> = first.collect();
        let more = match lit.len().saturating_sub(3) {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        let quality = refined.quality.0;
        let _ = writeln!(
            text,
            "  {:>3}  quality {quality}  {}{more}",
            i + 1,
            first.join(", ")
        );
    }
}

fn describe_store(text: &mut String, store: &StoreSummary) {
    let own: u64 = store.own.iter().map(|(_, bytes)| bytes).sum();
    let other: u64 = store.other.iter().sum();
    let _ = writeln!(
        text,
        "in {}: {}, {} of at most {}",
        store.folder.display(),
        count(store.own.len() + store.other.len(), "picture"),
        megabytes(own + other),
        megabytes(store.limit)
    );
    let mut steps: BTreeMap<Quality, usize> = BTreeMap::new();
    store
        .own
        .iter()
        .for_each(|(quality, _)| *steps.entry(*quality).or_default() += 1);
    let steps: Vec<String> = steps
        .iter()
        .map(|(q, n)| format!("{n} at quality {}", q.0))
        .collect();
    let listed = if steps.is_empty() {
        String::new()
    } else {
        format!(": {}", steps.join(", "))
    };
    let _ = writeln!(
        text,
        "  {} ({}) can serve this show{listed}",
        count(store.own.len(), "picture"),
        megabytes(own)
    );
    if !store.other.is_empty() {
        let _ = writeln!(
            text,
            "  {} ({}) belong to other scenes, lights, views or versions; `pool drop unused` \
             frees them",
            count(store.other.len(), "picture"),
            megabytes(other)
        );
    }
}

/// Describes what was freed.
pub fn freed(freed: &Freed) -> String {
    let mut text = format!("{} dropped from memory", count(freed.memory, "picture"));
    if let Some((images, bytes, folder)) = &freed.store {
        let _ = write!(
            text,
            ", {} ({}) from {}",
            count(*images, "picture"),
            megabytes(*bytes),
            folder.display()
        );
    }
    text
}
