//! Every diagnostic's code, in one table. A code keeps its meaning for ever; a retired code is not
//! reused.

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// `E…` errors, `W…` warnings.
    pub code: &'static str,
    /// The kind of error in a few words.
    pub title: &'static str,
}

macro_rules! codes {
    ($($name:ident = $code:literal $title:literal;)*) => {
        $(#[doc = $title] pub const $name: &str = $code;)*
        /// All codes, errors before warnings, in order.
        pub const TABLE: &[Code] = &[$(Code { code: $code, title: $title }),*];
    };
}

codes! {
    NOT_TEXT = "E001" "the file is not text";
    TOO_LARGE = "E002" "more than this program reads";
    EMPTY = "E003" "nothing is declared";
    UNCLOSED = "E004" "a brace, quote or comment is not closed";
    STRAY_BRACE = "E005" "a closing brace without its opening one";
    UNKNOWN_STATEMENT = "E006" "no statement begins so";
    SYNTAX = "E007" "something else is expected here";
    TOO_MANY = "E009" "too many errors to go on";
    UNKNOWN_NAME = "E010" "a name that is not declared";
    WRONG_KIND_OF_NAME = "E011" "a name of another kind";
    DECLARED_TWICE = "E012" "a name declared twice";
    RESERVED = "E013" "a word that cannot be a name";
    SAID_TWICE = "E014" "said twice";
    CYCLE = "E015" "defined by itself";
    INCLUDE = "E016" "a file that cannot be included";
    WRONG_QUANTITY = "E020" "a quantity of another kind";
    BAD_NUMBER = "E021" "not a number of this language";
    LEVEL_RANGE = "E022" "a level outside 0 to 100";
    RANGE = "E023" "a number out of its range";
    BAD_COLOUR = "E024" "not a colour";
    MISSING = "E025" "something is missing";
    DOES_NOT_FIT = "E026" "does not fit here";
    BEAM = "E027" "a field not wider than its beam";
    CALCULATION = "E028" "a calculation that comes to nothing";
    CUE_NUMBER = "E030" "not a cue number";
    CUE_TWICE = "E031" "a cue number used twice";
    MOVED_TWICE = "E032" "a bank twice in a cue";
    FOLLOW_AND_HANG = "E033" "follow and hang in one cue";
    MISPLACED = "E034" "in the wrong place";
    PART_NUMBER = "E035" "a part number used twice";
    NO_LEVEL = "E036" "a bank without a level";
    NOT_RGB = "E037" "a colour on a bank that is not rgb";
    KNOTS = "E038" "knots that do not follow each other";
    CURVE_ENDS = "E039" "a curve with wrong ends";
    KNOT_FORM = "E040" "a knot of the wrong form";
    LAST_LINK = "E041" "follow or hang on the last cue";
    ORDER = "E042" "times that go backwards";
    STARTED_TWICE = "E043" "a cue with two triggers";
    NO_HEAD = "E044" "a move of what does not move";
    OUT_OF_REACH = "E045" "a place out of a head's reach";
    HEAD_PLACE = "E046" "a head in two banks, or fixed";
    CURVE_RANGE = "E050" "a curve leaves 0 to 100";
    TIMELINE = "E051" "the cues do not make a timeline";
    STAGE_FILE = "E301" "a stage file that cannot be read";
    SURFACE = "E302" "a surface that the stage does not have";
    MATERIAL = "E303" "a panel of no material of the stage";
    DARK = "E304" "a panel of a material that does not emit";
    IMAGE = "E305" "an image that cannot be used";
    IMAGE_LAYER = "E306" "an image without that layer";
    IMAGE_SIZE = "E307" "images of different sizes";
    NO_AREA = "E308" "light spread over no surface";
    PHOTOMETRIC = "E309" "a photometric file that cannot be read";
    SLIDE = "E310" "an image that cannot be thrown";
    NO_LAMP = "E311" "a light that the stage does not have";
    LAMP = "E312" "a light of the stage that cannot be used";
    NO_CAMERA = "E313" "a camera that the stage does not have";
    UNUSED_BANK = "W001" "a bank that no cue moves";
    UNUSED_LIGHT = "W002" "a light in no bank";
    STILL_CUE = "W003" "a cue that moves nothing";
    SHARED_LIGHT = "W004" "a light in two banks";
    SHARED_CHANNEL = "W005" "two banks on one channel";
    LAST_MOVE_TIMING = "W006" "timing of the last of several moves";
    PATH_TIMING = "W007" "timing that a path does not take";
    FRACTIONS = "W008" "levels that look like fractions";
    NO_VIEW = "W009" "a stage and lights that nobody looks at";
    OVERTAKEN = "W010" "a cue overtaken before it starts";
    JUMP = "W011" "a path that jumps at its start";
    CUT_OFF = "W012" "a fade longer than it has time for";
    NO_CHANGE = "W013" "a cue that changes nothing";
    DARK_STRETCH = "W014" "a dark stretch";
    REPEAT_JUMP = "W015" "a repeated path that jumps";
    LAMP_INSIDE = "W016" "a lamp inside a solid";
    STAGE_NOTES = "W017" "a stage that is not taken as it stands";
    UNLIT = "W018" "a bank without light at the view";
    SMALL_STAGE = "W020" "a set that is a dot in the view";
    IMAGE_IN_HAZE = "W021" "an image as a bank in haze";
    HEAD_LATE = "W022" "a head that is not in place in time";
    HEAD_SEEN = "W023" "a head that is seen to turn in a fade to black";
    ENDLESS_EFFECT = "W024" "an effect that never ends on a bank that is out";
    SHINING_SET = "W025" "a panel that is most of the set";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_in_order_and_unique() {
        assert!(TABLE.windows(2).all(|w| w[0].code < w[1].code));
        assert!(TABLE.contains(&Code {
            code: "E012",
            title: "a name declared twice",
        }));
    }
}
