//! Packets of the lighting network: E1.31 (streaming ACN, ANSI E1.31-2018) and ArtDmx (Art-Net 4).

use super::patch::UNIVERSE;

/// The port of E1.31.
pub const SACN_PORT: u16 = 5568;
/// The port of Art-Net.
pub const ARTNET_PORT: u16 = 6454;
/// Number of universes of Art-Net.
pub const MOST_PORTS: u16 = 32_768;

/// The source of E1.31 packets.
#[derive(Clone, Debug)]
pub struct Sender {
    /// Unique id of the sender.
    pub cid: [u8; 16],
    /// Its name, cut to 63 bytes.
    pub name: String,
    /// 0 to 200; receivers use the highest.
    pub priority: u8,
}

/// An E1.31 data packet of 638 bytes: 512 `values` for a universe. The last packets of a stream are
/// marked as terminated.
pub fn sacn(
    source: &Sender,
    universe: u16,
    sequence: u8,
    values: &[u8],
    terminated: bool,
) -> Vec<u8> {
    let mut out = Vec::with_capacity(638);
    // Root layer: preamble, postamble, identifier, length and vector.
    out.extend([0x00, 0x10, 0x00, 0x00]);
    out.extend(b"ASC-E1.17\0\0\0");
    out.extend([0x72, 0x6e, 0, 0, 0, 4]);
    out.extend(source.cid);
    // Framing layer.
    out.extend([0x72, 0x58, 0, 0, 0, 2]);
    let mut name: Vec<u8> = source.name.bytes().take(63).collect();
    name.resize(64, 0);
    out.extend(name);
    out.extend([
        source.priority,
        0,
        0,
        sequence,
        if terminated { 0x40 } else { 0 },
    ]);
    out.extend(universe.to_be_bytes());
    // Device management layer: 513 values from address 0, which is the start code.
    out.extend([0x72, 0x0b, 0x02, 0xa1, 0, 0, 0, 1, 0x02, 0x01, 0]);
    out.extend(values.iter().take(UNIVERSE));
    out.resize(638, 0);
    out
}

/// The multicast address of a universe.
pub fn sacn_group(universe: u16) -> [u8; 4] {
    let [high, low] = universe.to_be_bytes();
    [239, 255, high, low]
}

/// An ArtDmx packet of 530 bytes: 512 `values` for a port address, counted from 0.
pub fn artnet(port: u16, sequence: u8, values: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(530);
    out.extend(b"Art-Net\0");
    // ArtDmx, protocol 14, sequence (0 would mean none), physical port, address, length.
    out.extend([0x00, 0x50, 0, 14, sequence.max(1), 0]);
    out.extend(port.to_le_bytes());
    out.extend((UNIVERSE as u16).to_be_bytes());
    out.extend(values.iter().take(UNIVERSE));
    out.resize(530, 0);
    out
}
