//! What `help` says of declarations: how each is written, with an example. Together the examples
//! are a show.

/// A kind of declaration.
pub struct Declaration {
    /// How it is written, its own word first.
    pub usage: &'static str,
    /// What it is for.
    pub about: &'static str,
    /// One that can be typed.
    pub example: &'static str,
}

impl Declaration {
    /// Its first word.
    pub fn word(&self) -> &'static str {
        self.usage.split(' ').next().unwrap_or(self.usage)
    }
}

const fn of(usage: &'static str, about: &'static str, example: &'static str) -> Declaration {
    Declaration {
        usage,
        about,
        example,
    }
}

/// All of them, in the order in which a show has them.
pub const DECLARATIONS: [Declaration; 17] = [
    of("show \"TITLE\"", "the title", "show \"First light\""),
    of(
        "preview { SETTING ... }",
        "how pictures are made: tolerance, coarse, refined, exposure, rate, gap",
        "preview { tolerance 1%  coarse 1  refined 4 }",
    ),
    of(
        "include \"FILE.lxq\"",
        "another file's declarations, as if they stood here",
        "include \"rig.lxq\"",
    ),
    of(
        "gels \"FILE.csv\"",
        "a table of gels: number, name and colour in each line, for `gel L201`",
        "gels \"lee.csv\"",
    ),
    of(
        "let NAME = VALUE",
        "a value with a name, used wherever its kind fits",
        "let warm = 2700 K",
    ),
    of(
        "stage \"FILE\"",
        "the geometry: OBJ or glTF, next to the show's file",
        "stage \"first.obj\"",
    ),
    of(
        "surface NAME reflectance COLOUR|SHARE { SOLID ... }",
        "how a material reflects, in place of the stage's; with solids that are made of it",
        "surface floor  reflectance 0.3",
    ),
    of(
        "view NAME from X, Y, Z to X, Y, Z fov DEGREES size WxH",
        "who looks at the stage: metres, Z up",
        "view house  from 0, -11, 2  to 0, 3, 1.6  fov 26  size 480x270",
    ),
    of(
        "light NAME panel MATERIAL | spot at PLACE aim PLACE beam A field B | ...",
        "what shines, at full: a surface of the stage, a spot, a photometric file, an image thrown",
        "light key  spot  at -3, -6, 5  aim 0, 1, 1  beam 20  field 35  9000 cd  2700 K",
    ),
    of(
        "bank NAME = LIGHT ... channel N",
        "lights that always move together: one channel of the desk",
        "bank front = key  channel 1",
    ),
    of(
        "fixed NAME = LIGHT ... level PERCENT",
        "lights that the desk never touches",
        "fixed exits = sign  level 30",
    ),
    of(
        "group NAME = BANK ...",
        "banks set by one word, each at the same level",
        "group all = front",
    ),
    of(
        "look NAME { BANK LEVEL ... }",
        "levels with a name, for cues and other looks",
        "look evening  { front 40 }",
    ),
    of(
        "default time TIME",
        "the time of cues that have none",
        "default time 4",
    ),
    of(
        "curve NAME = spline 0 0, SHARE LEVEL, ..., 1 100",
        "how a fade goes, for cues that name it",
        "curve dawn = spline 0 0, 0.5 20, 1 100",
    ),
    of(
        "effect NAME = flicker|pulse rate TIMES depth SHARE seed N",
        "what runs on top of a level: `fire 60 effect candle`, until `fire effect none`",
        "effect candle = flicker  rate 6  depth 35%  seed 3",
    ),
    of(
        "cue NUMBER \"LABEL\" at TIME { BANK LEVEL ... time SECONDS }",
        "where levels go, from when and how fast; without `at` it waits for GO",
        "cue 2 \"Evening\"  at 0:04 { evening  time 3 }",
    ),
];

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::diagnostic::Sources;
    use crate::lang;

    #[test]
    fn every_declaration_is_explained() {
        let words: Vec<&str> = DECLARATIONS.iter().map(Declaration::word).collect();
        let mut known = lang::keywords().to_vec();
        known.sort_by_key(|word| words.iter().position(|w| w == word));
        assert_eq!(words, known);
    }

    /// They are typed as they stand, and together they are a show.
    #[test]
    fn examples_are_a_show() {
        let mut text = String::from("light sign panel exit\n");
        for d in &DECLARATIONS {
            assert!(lang::is_declaration(d.example), "{}", d.example);
            let laid_out = lang::format(d.example).unwrap();
            assert_eq!(laid_out.trim_end(), d.example);
            if !["include", "gels"].contains(&d.word()) {
                text += d.example;
                text.push('\n');
            }
        }
        let parsed = lang::parse(&mut Sources::default(), "examples.lxq", &text);
        let found: Vec<&str> = parsed
            .diagnostics
            .iter()
            .map(|d| d.message.as_str())
            .collect();
        assert!(parsed.show.is_some(), "{found:?}");
    }
}
