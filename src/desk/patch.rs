//! Which bank is on which address of the lighting network.

use std::collections::BTreeMap;

use super::Loss;
use footlight_show::model::Show;

/// Values of a universe (DMX512).
pub const UNIVERSE: usize = 512;
/// The most universes that E1.31 has.
pub const MOST_UNIVERSES: u16 = 63_999;

/// Bytes of a universe, by its number from 1.
pub type Frames = BTreeMap<u16, Vec<u8>>;

/// One coordinate of the show on an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Index into [`Show::coordinates`].
    pub coordinate: usize,
    /// From 1.
    pub universe: u16,
    /// From 0.
    pub offset: usize,
    /// Two bytes, the higher first.
    pub fine: bool,
}

/// Every coordinate's addresses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Patch {
    slots: Vec<Slot>,
}

impl Patch {
    /// Each bank at the address of its channel, an rgb bank at that and the next two: channel 513 is
    /// the first address of universe 2. A bank without a channel, or one whose addresses others
    /// have, comes behind the last; what was moved so is listed.
    pub fn of_channels(show: &Show) -> (Patch, Vec<Loss>) {
        let (mut taken, mut losses) = (BTreeMap::new(), Vec::new());
        let mut starts = Vec::new();
        for bank in &show.banks {
            let width = if bank.rgb { 3 } else { 1 };
            let own = bank.channel.map(|channel| channel as usize - 1);
            let free = |start: &usize| {
                fits(*start, width) && (0..width).all(|i| !taken.contains_key(&(start + i)))
            };
            let start = own.filter(free);
            if let Some(start) = start {
                taken.extend((start..start + width).map(|at| (at, ())));
            }
            starts.push((start, width));
        }
        let mut next = taken.last_key_value().map_or(0, |(last, ())| last + 1);
        let mut patch = Patch::default();
        let mut coordinate = 0;
        for (bank, (start, width)) in show.banks.iter().zip(starts) {
            let at = start.unwrap_or_else(|| {
                if !fits(next, width) {
                    next = (next / UNIVERSE + 1) * UNIVERSE;
                }
                next += width;
                let at = next - width;
                let (universe, offset) = (at / UNIVERSE + 1, at % UNIVERSE + 1);
                let what = format!("bank `{}` is at address {universe}/{offset}", bank.name);
                losses.push(Loss::new(what));
                at
            });
            for emitter in 0..width {
                patch.add(coordinate, at + emitter, false);
                coordinate += 1;
            }
        }
        (patch, losses)
    }

    /// A patch from text: lines of a bank's name, an address as universe and number (`2/101`), and
    /// `16bit` where a value has two bytes. A bank may be at several addresses.
    ///
    /// # Errors
    /// The first line that cannot be used, with what to write.
    pub fn parse(show: &Show, text: &str) -> Result<Patch, String> {
        let mut patch = Patch::default();
        let mut taken: BTreeMap<usize, usize> = BTreeMap::new();
        for (index, line) in text.lines().enumerate() {
            let line = line.split("//").next().unwrap_or_default();
            let words: Vec<&str> = line.split_whitespace().collect();
            let refuse = |what: String| format!("line {}: {what}", index + 1);
            let (name, address, fine) = match words.as_slice() {
                [] => continue,
                [name, address] => (*name, *address, false),
                [name, address, "16bit"] => (*name, *address, true),
                _ => {
                    let what = "write a bank, its address, and `16bit` where it has two bytes: \
                                `lamps 1/101 16bit`";
                    return Err(refuse(what.to_owned()));
                }
            };
            let named = |coordinate: &(usize, _)| {
                show.banks.get(coordinate.0).map(|b| b.name.as_str()) == Some(name)
            };
            let coordinates = show.coordinates();
            let mine = coordinates.iter().enumerate();
            let mine = mine
                .filter_map(|(index, c)| Some((c.bank?, index)))
                .filter(named);
            let mine: Vec<usize> = mine.map(|(_, index)| index).collect();
            if mine.is_empty() {
                return Err(refuse(format!("there is no bank called `{name}`")));
            }
            let Some(start) = start_of(address) else {
                let what =
                    format!("`{address}` is no address: universe and number, such as `2/101`");
                return Err(refuse(what));
            };
            let width = mine.len() * if fine { 2 } else { 1 };
            if !fits(start, width) {
                let what = format!("`{name}` takes {width} addresses and goes beyond 512");
                return Err(refuse(what));
            }
            for at in start..start + width {
                if let Some(earlier) = taken.insert(at, index + 1) {
                    let what = format!(
                        "`{name}` takes address {}, which line {earlier} has",
                        at % UNIVERSE + 1
                    );
                    return Err(refuse(what));
                }
            }
            for (position, coordinate) in mine.into_iter().enumerate() {
                let at = start + position * if fine { 2 } else { 1 };
                patch.add(coordinate, at, fine);
            }
        }
        Ok(patch)
    }

    fn add(&mut self, coordinate: usize, at: usize, fine: bool) {
        self.slots.push(Slot {
            coordinate,
            universe: (at / UNIVERSE + 1) as u16,
            offset: at % UNIVERSE,
            fine,
        });
    }

    /// The addresses.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// Dark universes, one for each that has an address.
    pub fn dark(&self) -> Frames {
        let universes = self.slots.iter().map(|slot| slot.universe);
        universes
            .map(|universe| (universe, vec![0; UNIVERSE]))
            .collect()
    }

    /// Writes settings, 0 to 1, into the universes: to the nearest of 256 steps, or of 65,536.
    pub fn fill(&self, settings: &[f64], frames: &mut Frames) {
        for slot in &self.slots {
            let value = settings.get(slot.coordinate).copied().unwrap_or(0.0);
            let Some(frame) = frames.get_mut(&slot.universe) else {
                continue;
            };
            let bytes = if slot.fine {
                step(value, 65535.0).to_be_bytes().to_vec()
            } else {
                vec![step(value, 255.0) as u8]
            };
            for (place, byte) in frame.iter_mut().skip(slot.offset).zip(bytes) {
                *place = byte;
            }
        }
    }
}

fn fits(start: usize, width: usize) -> bool {
    start % UNIVERSE + width <= UNIVERSE && start / UNIVERSE < usize::from(MOST_UNIVERSES)
}

fn step(value: f64, full: f64) -> u16 {
    (value.clamp(0.0, 1.0) * full).round() as u16
}

/// The first address of `2/101`, counted from 0 over all universes.
fn start_of(address: &str) -> Option<usize> {
    let (universe, number) = address.split_once('/')?;
    let (universe, number): (u16, usize) = (universe.parse().ok()?, number.parse().ok()?);
    let known = (1..=MOST_UNIVERSES).contains(&universe) && (1..=UNIVERSE).contains(&number);
    known.then(|| (usize::from(universe) - 1) * UNIVERSE + number - 1)
}
