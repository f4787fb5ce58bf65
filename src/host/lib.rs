//! What an embedding program gives to Footlight.
//!
//! All effects on the outside go through this crate. An embedding program implements its traits, or
//! takes the ready ones.
//!
//! - [`files`]: reading ([`Files`](files::Files)), writing ([`Store`](files::Store)), the clock
//!   ([`Clock`](files::Clock)), and programs that are started. [`Folder`](files::Folder) and
//!   [`Memory`](files::Memory) are two places to read from; [`Disk`](files::Disk) and
//!   [`MemoryStore`](files::MemoryStore) two to write to.
//! - [`work`]: progress and cancel ([`Progress`](work::Progress)), threads and memory
//!   ([`Work`](work::Work)) for one call.
//!
//! Nothing here knows shows, pictures or the stage.

pub mod files;
pub mod work;
