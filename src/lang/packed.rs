//! Parsed cues in few bytes, to be kept from one reading of a text to the next: places are written as
//! their distances from those before them, words as their places, and read back beside the text.
//! Invariant: what is unpacked beside the same text is what was packed, at the places where the text
//! stands now.

use super::ast::{
    Body, Cue, Knot, Level, Mark, Motion, Move, Part, Path, Span, Target, Term, Timing, TimingKind,
    Word,
};
use crate::show::Interpolation;

/// A parsed cue without its text.
#[derive(Clone, Debug)]
pub struct PackedCue(Box<[u8]>);

impl PackedCue {
    /// Packs a cue and the place of its statement, in a text that begins at byte `start` of its file.
    pub fn of(span: Span, cue: &Cue<'_>, start: u32) -> PackedCue {
        let (bytes, last) = (Vec::new(), start);
        let mut to = Writer { bytes, last };
        span.pack(&mut to);
        cue.pack(&mut to);
        PackedCue(to.bytes.into())
    }

    /// The cue where its text begins at byte `start` of a file of these contents.
    pub fn unpacked<'a>(&self, source: &'a str, file: u32, start: u32) -> Option<(Span, Cue<'a>)> {
        let mut from = Reader {
            bytes: &self.0,
            source,
            file,
            last: start,
        };
        Some((Span::unpack(&mut from)?, Cue::unpack(&mut from)?))
    }
}

struct Writer {
    bytes: Vec<u8>,
    /// Where the last place began.
    last: u32,
}

impl Writer {
    /// Seven bits a byte, the least first.
    fn number(&mut self, mut number: u32) {
        while number > 0x7f {
            self.bytes.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.bytes.push(number as u8);
    }
}

struct Reader<'p, 'a> {
    bytes: &'p [u8],
    source: &'a str,
    file: u32,
    last: u32,
}

impl Reader<'_, '_> {
    fn number(&mut self) -> Option<u32> {
        let mut number = 0;
        for shift in (0..u32::BITS).step_by(7) {
            let (byte, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            number |= u32::from(byte & 0x7f) << shift;
            if *byte < 0x80 {
                return Some(number);
            }
        }
        None
    }
}

/// What can be packed. `None` stands for bytes that no packing made.
trait Pack<'a>: Sized {
    fn pack(&self, to: &mut Writer);
    fn unpack(from: &mut Reader<'_, 'a>) -> Option<Self>;
}

impl<'a> Pack<'a> for Span {
    fn pack(&self, to: &mut Writer) {
        // Places mostly ascend: the sign is the lowest bit.
        let step = self.start.wrapping_sub(to.last) as i32;
        to.number(((step << 1) ^ (step >> 31)) as u32);
        to.number(self.end.saturating_sub(self.start));
        to.last = self.start;
    }

    fn unpack(from: &mut Reader<'_, 'a>) -> Option<Span> {
        let step = from.number()?;
        let step = (step >> 1) ^ (step & 1).wrapping_neg();
        let start = from.last.wrapping_add(step);
        from.last = start;
        Some(Span {
            file: from.file,
            start,
            end: start.checked_add(from.number()?)?,
        })
    }
}

impl<'a> Pack<'a> for Word<'a> {
    fn pack(&self, to: &mut Writer) {
        self.span.pack(to);
    }

    fn unpack(from: &mut Reader<'_, 'a>) -> Option<Word<'a>> {
        let span = Span::unpack(from)?;
        let text = from.source.get(span.range())?;
        Some(Word { text, span })
    }
}

impl<'a, T: Pack<'a>> Pack<'a> for Option<T> {
    fn pack(&self, to: &mut Writer) {
        to.number(u32::from(self.is_some()));
        if let Some(value) = self {
            value.pack(to);
        }
    }

    fn unpack(from: &mut Reader<'_, 'a>) -> Option<Option<T>> {
        match from.number()? {
            0 => Some(None),
            _ => T::unpack(from).map(Some),
        }
    }
}

impl<'a, T: Pack<'a>> Pack<'a> for Vec<T> {
    fn pack(&self, to: &mut Writer) {
        to.number(self.len() as u32);
        self.iter().for_each(|each| each.pack(to));
    }

    fn unpack(from: &mut Reader<'_, 'a>) -> Option<Vec<T>> {
        let count = from.number()?;
        (0..count).map(|_| T::unpack(from)).collect()
    }
}

impl<'a, A: Pack<'a>, B: Pack<'a>> Pack<'a> for (A, B) {
    fn pack(&self, to: &mut Writer) {
        self.0.pack(to);
        self.1.pack(to);
    }

    fn unpack(from: &mut Reader<'_, 'a>) -> Option<(A, B)> {
        Some((A::unpack(from)?, B::unpack(from)?))
    }
}

impl<'a, A: Pack<'a>, B: Pack<'a>, C: Pack<'a>> Pack<'a> for (A, B, C) {
    fn pack(&self, to: &mut Writer) {
        self.0.pack(to);
        self.1.pack(to);
        self.2.pack(to);
    }

    fn unpack(from: &mut Reader<'_, 'a>) -> Option<(A, B, C)> {
        Some((A::unpack(from)?, B::unpack(from)?, C::unpack(from)?))
    }
}

/// Packs the fields of a struct one after the other.
macro_rules! pack_fields {
    ($($name:ident { $($field:ident),* })*) => {$(
        impl<'a> Pack<'a> for $name<'a> {
            fn pack(&self, to: &mut Writer) {
                // Names all fields, so that none is forgotten.
                let $name { $($field),* } = self;
                $($field.pack(to);)*
            }

            fn unpack(from: &mut Reader<'_, 'a>) -> Option<$name<'a>> {
                Some($name { $($field: Pack::unpack(from)?),* })
            }
        }
    )*};
}

pack_fields! {
    Cue { number, label, at, body }
    Body { timing, moves, parts, marks, notes }
    Part { number, label, body, span }
    Move { target, motion, effect, timing, span, beside }
    Target { name, channel, span }
    Timing { kind, value, second, span }
    Path { interpolation, knots, span }
    Knot { at, value, slope, via, span }
    Level { target, value, second }
}

/// Packs a choice as a number, and what it has besides.
macro_rules! pack_choices {
    ($($name:ty { $($number:literal = $choice:ident $(($($inner:ident),*))?),* })*) => {$(
        impl<'a> Pack<'a> for $name {
            fn pack(&self, to: &mut Writer) {
                match self {
                    $(Self::$choice $(($($inner),*))? => {
                        to.number($number);
                        $($($inner.pack(to);)*)?
                    })*
                }
            }

            fn unpack(from: &mut Reader<'_, 'a>) -> Option<$name> {
                Some(match from.number()? {
                    $($number => {
                        $($(let $inner = Pack::unpack(from)?;)*)?
                        Self::$choice $(($($inner),*))?
                    })*
                    _ => return None,
                })
            }
        }
    )*};
}

pack_choices! {
    Motion<'a> { 0 = Bare, 1 = To(level, second), 2 = Path(path), 3 = Plus(terms) }
    Term<'a> { 0 = Look(name), 1 = Levels(levels) }
    TimingKind { 0 = Time, 1 = Up, 2 = Down, 3 = Delay, 4 = Snap, 5 = Curve, 6 = Repeat }
    Mark { 0 = Follow, 1 = Hang, 2 = At, 3 = Block, 4 = Assert, 5 = Cueonly }
    Interpolation {
        0 = Linear, 1 = Steps, 2 = Natural, 3 = Clamped, 4 = Monotone, 5 = CatmullRom, 6 = Hermite,
        7 = Bezier
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::ast::Declaration;
    use crate::lang::read::typed;

    /// Every form that a cue can have, read back at another place of another file.
    #[test]
    fn an_unpacked_cue_is_the_packed_one() {
        let cues = [
            "cue 1 { }",
            "cue 2 \"Über 🌙\" at 0:04 { time 4/3  note \"Ö\"  lamps 40  sky 30 #203060 delay 2\n\
             \x20 sky.r full  night 50  base + night + { lamps out  sky #fff 20 }\n follow 3 }",
            "cue 3 { up 3 down 4 curve dawn\n blackout  block assert cueonly\n hang -1\n\
             \x20 part 2 \"slow\" { snap  lamps bezier 0 0 via 10 50, 5 60 repeat 3\n a effect fire } }",
            "cue 4.25 { lamps hermite 0 0 slope 3, 5 (v + 2) slope 0 }",
        ];
        for interpolation in [
            "steps",
            "natural",
            "clamped",
            "catmull-rom",
            "bezier",
            "spline",
        ] {
            packed_and_back(&format!("cue 5 {{ a {interpolation} 0 0, 5 60 }}"));
        }
        cues.into_iter().for_each(packed_and_back);
    }

    fn packed_and_back(text: &str) {
        let (_, read, _) = typed(text).unwrap();
        let [statement] = read.statements.as_slice() else {
            panic!("{text}");
        };
        let Declaration::Cue(cue) = &statement.item else {
            panic!("{text}");
        };
        let packed = PackedCue::of(statement.span, cue, statement.span.start);
        let unpacked = packed.unpacked(text, 0, 0).unwrap();
        assert_eq!(
            format!("{unpacked:?}"),
            format!("{:?}", (statement.span, cue))
        );
        let moved = format!("// ö\n{text}");
        let start = moved.len() - text.len();
        let (_, read, _) = typed(&moved).unwrap();
        let Declaration::Cue(cue) = &read.statements[0].item else {
            panic!("{text}");
        };
        let unpacked = packed.unpacked(&moved, 0, start as u32).unwrap();
        let expected = (read.statements[0].span, cue);
        assert_eq!(format!("{unpacked:?}"), format!("{expected:?}"));
        assert!(packed.0.len() < 2 * text.len() + 16, "{}", packed.0.len());
        assert!(packed.unpacked("", 0, 0).is_none());
    }
}
