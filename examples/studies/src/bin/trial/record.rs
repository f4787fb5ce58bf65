//! Verdicts on metrics, previews and predictions as one table.

use footlight_engine::measure::Machine;
use footlight_studies::evaluation::Verdict;
use footlight_studies::record::{Origin, Quantity, Record, StudyKind};

/// The table: a series for each order, preview and prediction, a point for each row of each show.
pub fn record(verdicts: &[Verdict], machine: Machine, method: &str) -> Record {
    let columns = [
        ("pictures to 5 %", ""),
        ("pictures to 1 %", ""),
        ("the same by the pool's preview", ""),
        ("to 1 % by the pool's preview", ""),
        ("looks worse than coarse", "%"),
        ("worst look over coarse", ""),
        ("median look over coarse", ""),
        ("sequence over coarse", ""),
        ("refined pictures", ""),
        ("predicted over true error", ""),
        ("true error", "%"),
    ];
    let columns = columns.iter().map(|(n, u)| Quantity::new(n, u)).collect();
    let origin = Origin {
        subject: "random shows and the tavern".to_owned(),
        machine,
    };
    let mut out = Record::new(StudyKind::Trial, &origin, method, columns);
    for verdict in verdicts {
        for row in &verdict.needed {
            let counts = [row.own, row.pool].concat();
            let values: Vec<Option<f64>> = counts.iter().map(|c| Some(*c as f64)).collect();
            let series = format!("metric {}", row.rule.name());
            out.add(&series, &verdict.name, &[], &values);
        }
        for row in &verdict.previewed {
            let mut values = vec![None; 4];
            values.extend([100.0 * row.worse, row.worst, row.look, row.sequence].map(Some));
            let series = format!("preview {}", row.projection.name());
            out.add(&series, &verdict.name, &[], &values);
        }
        for row in &verdict.steps {
            let mut values = vec![None; 8];
            values.extend([row.refined as f64, row.ratio, 100.0 * row.truth].map(Some));
            out.add("prediction", &verdict.name, &[], &values);
        }
    }
    out
}
