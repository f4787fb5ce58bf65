//! Diagnostics in the protocol's form.

use lsp_types::{DiagnosticRelatedInformation, DiagnosticSeverity, Location, NumberOrString};

use super::buffers::uri_of;
use super::open_show::OpenShow;
use super::text::Lines;
use footlight_show::diagnostic::{Diagnostic, Label, Severity};

/// Converts a diagnostic; `lines` are the lines of each file.
pub fn diagnostic_of(
    show: &OpenShow,
    lines: &[Lines<'_>],
    diagnostic: &Diagnostic,
) -> lsp_types::Diagnostic {
    let range = |label: &Label| {
        let own = lines.get(label.file);
        own.map_or_else(Default::default, |lines| lines.range(&label.span))
    };
    let mut message = diagnostic.message.clone();
    let main = diagnostic.labels.first();
    if let Some(label) = main.filter(|label| !label.text.is_empty()) {
        message.push_str(&format!("\n{}", label.text));
    }
    for help in &diagnostic.help {
        message.push_str(&format!("\nhelp: {help}"));
    }
    let related = diagnostic.labels.iter().skip(1).filter_map(|label| {
        let (path, _) = show.file(label.file)?;
        Some(DiagnosticRelatedInformation {
            location: Location::new(uri_of(&path)?, range(label)),
            message: label.text.clone(),
        })
    });
    let related: Vec<_> = related.collect();
    let code =
        (!diagnostic.code.is_empty()).then(|| NumberOrString::String(diagnostic.code.to_owned()));
    lsp_types::Diagnostic {
        range: main.map_or_else(Default::default, range),
        severity: Some(match diagnostic.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code,
        source: Some("footlight".to_owned()),
        message,
        related_information: (!related.is_empty()).then_some(related),
        ..lsp_types::Diagnostic::default()
    }
}
