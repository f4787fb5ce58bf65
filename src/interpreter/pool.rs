//! `pool`: what pictures there are, which of them serve the show, and freeing the others.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::answer::count;
use super::{Call, Error, Interpreter, Reply};
use crate::plan;
use crate::pool::Pool;
use crate::pool::archive::Archive;
use crate::pool::depot::Stored;
use crate::renderer::Quality;

impl Interpreter {
    pub(super) fn answer_pool(&mut self, call: &Call) -> Result<Reply, Error> {
        let words: Vec<&str> = call.words.iter().map(String::as_str).collect();
        match words.as_slice() {
            [] => Ok(Reply::text(self.describe_pool())),
            ["drop"] | ["drop", "unused"] => self.drop_pictures(false),
            ["drop", "all"] => self.drop_pictures(true),
            _ => Err(Error::Usage(
                "usage: pool, pool drop unused (what this show cannot use), or pool drop all"
                    .to_owned(),
            )),
        }
    }

    fn describe_pool(&self) -> String {
        let mut text = self.headline() + "\n";
        match self.pool() {
            Some(pool) => self.describe_pictures(&mut text, pool),
            None => {
                let refined = count(self.refined(), "refined picture");
                let _ = writeln!(text, "no coarse pictures in memory yet; {refined}");
            }
        }
        let Some(archive) = self.stage.as_ref().map(|s| &s.archive) else {
            return text;
        };
        let held = self.pool().map_or(0, |p| pictures_of(p).len());
        let idle = archive.kept().len().saturating_sub(held);
        if idle > 0 {
            let _ = writeln!(
                text,
                "{} kept that an edit put aside",
                count(idle, "picture")
            );
        }
        self.describe_store(&mut text, archive);
        text
    }

    fn describe_pictures(&self, text: &mut String, pool: &Pool) {
        let [cheap, fine] = self.coarse_steps();
        let (width, height) = pool.size();
        let bytes = pictures_of(pool).len() * width * height * 12;
        let _ = writeln!(
            text,
            "in memory: {} at quality {cheap} and {fine}, {}, {width}x{height}, {}",
            count(pool.coarse().len(), "coarse picture"),
            count(pool.refined().len(), "refined picture"),
            megabytes(bytes as u64)
        );
        let names = self.show().coordinates();
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
        let near = self.stage.as_ref().map_or(0, |s| s.near_copies);
        if near > 0 {
            let _ = writeln!(
                text,
                "  {} not used: less than a thousandth of each lies outside the span of these, and \
                 what it would add is rounding",
                count(near, "known refined picture")
            );
        }
        let next = plan::next(
            &self.compiled.keys,
            &pool.settings(),
            &pool.weighting(),
            None,
        );
        for refused in next.map(|n| n.refused).unwrap_or_default() {
            let _ = writeln!(
                text,
                "  {:>3}  adds nothing: it lies in the span of those before it (norm {:.1e}, outside it {:.1e})",
                refused.index + 1,
                refused.before,
                refused.after
            );
        }
    }

    fn describe_store(&self, text: &mut String, archive: &Archive) {
        let Some(depot) = archive.depot() else {
            text.push_str("no store: pictures are kept until you leave\n");
            return;
        };
        let stored = depot.stored(self.host.store.as_ref());
        let (own, other): (Vec<Stored>, Vec<Stored>) =
            stored.into_iter().partition(|s| self.serves(archive, s));
        let bytes = |all: &[Stored]| all.iter().map(|s| s.bytes).sum::<u64>();
        let total = bytes(&own) + bytes(&other);
        let _ = writeln!(
            text,
            "in {}: {}, {} of at most {}",
            depot.folder().display(),
            count(own.len() + other.len(), "picture"),
            megabytes(total),
            megabytes(depot.limit())
        );
        let mut steps: BTreeMap<Quality, usize> = BTreeMap::new();
        own.iter()
            .for_each(|s| *steps.entry(s.quality).or_default() += 1);
        let steps: Vec<String> = steps
            .iter()
            .map(|(q, n)| format!("{n} at quality {}", q.0))
            .collect();
        let listed = match steps.is_empty() {
            true => String::new(),
            false => format!(": {}", steps.join(", ")),
        };
        let _ = writeln!(
            text,
            "  {} ({}) can serve this show{listed}",
            count(own.len(), "picture"),
            megabytes(bytes(&own))
        );
        if !other.is_empty() {
            let _ = writeln!(
                text,
                "  {} ({}) belong to other scenes, lights, views or versions; `pool drop unused` \
                 frees them",
                count(other.len(), "picture"),
                megabytes(bytes(&other))
            );
        }
    }

    /// Whether a stored picture can serve the show: its ground fits, and all its lights are there.
    fn serves(&self, archive: &Archive, stored: &Stored) -> bool {
        let (Some(stage), Some(depot)) = (&self.stage, archive.depot()) else {
            return false;
        };
        stage.is_ground(stored.ground)
            && depot
                .lighting(self.host.store.as_ref(), *stored)
                .is_some_and(|lighting| stage.serves(stored.ground, &lighting))
    }

    fn drop_pictures(&mut self, all: bool) -> Result<Reply, Error> {
        let mut freed = Vec::new();
        if let Some(depot) = self.stage.as_ref().and_then(|s| s.archive.depot()) {
            let archive = self.stage.as_ref().map(|s| &s.archive);
            let stored = depot.stored(self.host.store.as_ref()).into_iter();
            let goes = |s: &Stored| all || archive.is_none_or(|a| !self.serves(a, s));
            freed = stored.filter(goes).collect();
        }
        let Some(stage) = &mut self.stage else {
            return Err(super::refine::no_stage());
        };
        if all {
            stage.pool = None;
            self.steps.clear();
            self.exposure = None;
            self.brightness = None;
        }
        let held = stage.pool.as_ref().map(pictures_of).unwrap_or_default();
        let used = |image: &std::sync::Arc<_>| held.contains(&std::sync::Arc::as_ptr(image));
        let forgotten = stage.archive.forget(|kept| !used(&kept.image));
        let mut text = format!("{} dropped from memory", count(forgotten, "picture"));
        if let Some(depot) = stage.archive.depot_mut() {
            let store = self.host.store.as_ref();
            let (pictures, bytes) = depot.free(store, |s| freed.contains(s))?;
            let _ = write!(
                text,
                ", {} ({}) from {}",
                count(pictures, "picture"),
                megabytes(bytes),
                depot.folder().display()
            );
        }
        Ok(Reply::text(text))
    }
}

/// Every picture a pool holds, each once.
fn pictures_of(pool: &Pool) -> Vec<*const crate::picture::Image> {
    let refined = pool.refined().iter().map(|r| &r.image);
    let all = pool.coarse().iter().chain(pool.coarser()).chain(refined);
    let mut all: Vec<_> = all.map(std::sync::Arc::as_ptr).collect();
    all.sort();
    all.dedup();
    all
}

/// Bytes for people.
fn megabytes(bytes: u64) -> String {
    match bytes {
        0..=999_999 => format!("{:.0} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}
