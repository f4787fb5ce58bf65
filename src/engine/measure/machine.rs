//! What a result comes from: the show and the machine.

use serde::{Deserialize, Serialize};

use crate::{Engine, Host};

/// Where something was measured.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Threads that were used.
    pub threads: usize,
    /// Cores the machine has, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cores: Option<usize>,
    /// Operating system and architecture, as `linux x86_64`.
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

    /// This machine, as far as the standard library tells; the processor's name is the embedding
    /// program's to find.
    pub fn here(threads: usize, processor: Option<String>) -> Machine {
        Machine {
            threads,
            cores: std::thread::available_parallelism().ok().map(Into::into),
            system: [std::env::consts::OS, std::env::consts::ARCH].join(" "),
            processor,
        }
    }
}

/// What a result was measured of, and where.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// The show's title, or the name of what else was measured.
    pub subject: String,
    /// The machine.
    pub machine: Machine,
}

impl Origin {
    /// The show of an engine, and its machine.
    pub fn of(engine: &Engine) -> Origin {
        Origin {
            subject: engine.show().title.clone(),
            machine: Machine::of(engine.host()),
        }
    }
}
