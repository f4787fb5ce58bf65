//! The machine of a measurement.

use serde::Serialize;

use crate::Host;

/// The machine of a measurement.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Threads used.
    pub threads: usize,
    /// Cores the machine has, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cores: Option<usize>,
    /// Operating system and architecture, such as `linux x86_64`.
    pub system: String,
    /// The processor's name, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub processor: Option<String>,
}

impl Machine {
    /// The machine of a host.
    pub fn of(host: &Host) -> Machine {
        Machine::here(host.threads, host.processor.clone())
    }

    /// This machine, as far as the standard library knows it; the embedding program supplies the
    /// processor's name.
    pub fn here(threads: usize, processor: Option<String>) -> Machine {
        Machine {
            threads,
            cores: std::thread::available_parallelism().ok().map(Into::into),
            system: [std::env::consts::OS, std::env::consts::ARCH].join(" "),
            processor,
        }
    }
}
