//! The table of verbs, in the order of the manual, with their options.

use super::{Complete, OptionSpec, VerbSpec};
use crate::answer::{edit, export, help, live, measure, picture, play, plot, render, text};
use crate::{Call, Error, Repl, Reply};

const fn value(name: &'static str, value: &'static str, about: &'static str) -> OptionSpec {
    OptionSpec {
        name,
        letter: None,
        value: Some(value),
        about,
    }
}

const fn switch(name: &'static str, about: &'static str) -> OptionSpec {
    OptionSpec {
        name,
        letter: None,
        value: None,
        about,
    }
}

const fn output(about: &'static str) -> OptionSpec {
    OptionSpec {
        name: "output",
        letter: Some('o'),
        value: Some("FILE"),
        about,
    }
}

const JSON: OptionSpec = switch("json", "print data instead of words");

const WAY: OptionSpec = value(
    "way",
    "WAY",
    "how an error is reached: auto, paper (coarse pictures and mixtures) or alone (every bank at one \
     step of quality) (default: auto)",
);

const FARM: OptionSpec = value(
    "farm",
    "NAME",
    "have it rendered by other machines: slurm (the manual's page `farm`)",
);

const DARK: OptionSpec = switch("dark", "light lines on a dark ground, in a file too");

const FLOAT: OptionSpec = switch(
    "float",
    "an .exr in 32 bits a number (default: 16, the relative error 2^-11)",
);

const VIEW: OptionSpec = value("view", "NAME", "the view to look from (default: the first)");

/// What can be charted.
const CHARTS: &[&str] = &["transport"];

const QUALITY: OptionSpec = value(
    "quality",
    "Q",
    "the step of the scale, 1 to 3 (default: that of the show's coarse pictures)",
);

/// A verb of the prompt.
const fn verb(
    name: &'static str,
    run: fn(&mut Repl, &Call) -> Result<Reply, Error>,
    about: &'static str,
    example: &'static str,
) -> VerbSpec {
    VerbSpec {
        name,
        kinds: &[],
        words: "",
        options: &[],
        about,
        example,
        command: false,
        complete: Complete::Nothing,
        run,
    }
}

impl VerbSpec {
    /// A command of its own on the command line too.
    const fn command(mut self) -> VerbSpec {
        self.command = true;
        self
    }

    const fn words(mut self, words: &'static str, complete: Complete) -> VerbSpec {
        self.words = words;
        self.complete = complete;
        self
    }

    const fn kinds(mut self, kinds: &'static [&'static str]) -> VerbSpec {
        self.kinds = kinds;
        self
    }

    const fn options(mut self, options: &'static [OptionSpec]) -> VerbSpec {
        self.options = options;
        self
    }
}

/// Every verb, in the order of the manual.
pub const VERBS: &[VerbSpec] = &[
    verb(
        "check",
        text::check,
        "look for errors in the show, its stage and its curves",
        "check",
    )
    .command(),
    verb(
        "show",
        text::show,
        "list banks and cues with their times, or the text of NAME",
        "show lamps",
    )
    .words("[NAME | cue N]", Complete::Names),
    verb(
        "at",
        live::at,
        "move to a time and print the levels and the light there",
        "at cue 2 + 1s",
    )
    .words("[TIME | cue N [+ TIME]]", Complete::Cues),
    verb(
        "plan",
        render::plan,
        "keys, basis, and the error predicted after each refined picture",
        "plan --tolerance 1%",
    )
    .words("[N]", Complete::Nothing)
    .options(&[
        JSON,
        switch(
            "next",
            "the next N pictures to refine (default: 5), their seconds and what they leave",
        ),
        value(
            "tolerance",
            "X",
            "error allowed, such as 2% or 1.5steps (default: the show's preview)",
        ),
        WAY,
        VIEW,
        value(
            "tasks",
            "FILE",
            "write the pictures that are missing for the tolerance as tasks for `work`",
        ),
    ])
    .command(),
    verb(
        "picture",
        picture::picture,
        "one picture of the show",
        "picture 1:30 -o evening.png",
    )
    .words("[TIME | cue N [+ TIME]]", Complete::Cues)
    .options(&[
        value(
            "at",
            "TIME",
            "the moment (default: the current time, or the start)",
        ),
        value("cue", "N", "the moment at which this cue is complete"),
        value("bank", "NAME", "this bank alone, at full"),
        value(
            "quality",
            "Q",
            "render again at this step of the scale, 1 to 3",
        ),
        value(
            "exposure",
            "STOPS",
            "how bright the light shows (default: that of the sequence; of a bank alone its own)",
        ),
        VIEW,
        FLOAT,
        output("write a .png (as displayed) or an .exr (linear)"),
    ])
    .command(),
    verb(
        "refine",
        render::refine,
        "render refined pictures, most useful first; `&`: in the background",
        "refine until 2%",
    )
    .words("[N | until X | for TIME] [&]", Complete::Nothing)
    .options(&[VIEW, WAY, FARM])
    .command(),
    verb(
        "status",
        render::status,
        "how far the refinement in the background is, and when it will end",
        "status",
    ),
    verb(
        "wait",
        render::wait,
        "wait for the refinement; Ctrl-C ends the waiting alone",
        "wait",
    ),
    verb(
        "stop",
        render::stop,
        "end the refinement in the background after what is in hand, or now",
        "stop",
    )
    .words("[now]", Complete::Nothing),
    verb(
        "play",
        play::play,
        "play the sequence back from its key images",
        "play -o show.html",
    )
    .options(&[
        VIEW,
        value(
            "from",
            "TIME",
            "the first moment, such as 1:30 or \"cue 5\"",
        ),
        value(
            "cue",
            "N",
            "this cue alone, from its GO until it is complete",
        ),
        value(
            "layers",
            "WHAT",
            "layers of an .exr: keys (default), banks (each alone at full) or basis (the \
                 refined pictures)",
        ),
        FLOAT,
        value(
            "sacn",
            "N",
            "send as E1.31 (sACN), from universe N on, 44 frames a second",
        ),
        value(
            "to",
            "TIME",
            "the last moment; of --sacn the machine to send to, in place of multicast",
        ),
        value("priority", "P", "of --sacn, 0 to 200 (default: 100)"),
        value(
            "artnet",
            "HOST",
            "send as Art-Net to this machine or broadcast address",
        ),
        value(
            "bind",
            "ADDRESS",
            "the interface to send from and listen at (default: 127.0.0.1)",
        ),
        value(
            "patch",
            "FILE",
            "addresses of banks (default: their channels)",
        ),
        value("osc", "PORT", "wait for GO by OSC at this port"),
        value(
            "osc-to",
            "HOST:PORT",
            "of --osc: where cue and time are sent",
        ),
        value(
            "chroma",
            "C",
            "colour of a video: 420 (default) or 444, BT.709",
        ),
        output(
            "write a .html (a page that plays), a film (.mp4, .webm, by ffmpeg), a .y4m or `-` \
                 (video, to standard output), an .exr (layers), or \
                 numbered pictures such as frames/####.png",
        ),
    ])
    .command(),
    verb(
        "plot",
        plot::plot,
        "draw curves of banks and groups, or keys, spectrum, basis, error",
        "plot -o curves.svg",
    )
    .words("[BANK… | keys | spectrum | basis | error]", Complete::Banks)
    .options(&[
        value(
            "tolerance",
            "X",
            "of spectrum, the error allowed, such as 2% or 1.5steps (default: the show's preview)",
        ),
        DARK,
        output("write a .png or an .svg"),
    ])
    .command(),
    verb(
        "run",
        render::run,
        "the whole loop: pictures, plan, refined ones, page, cues, sheets",
        "run --until 2%",
    )
    .options(&[
        value(
            "until",
            "X",
            "refine until this error, such as 2% or 1.5steps (default: the show's preview)",
        ),
        value(
            "count",
            "N",
            "refine until there are N pictures, stored ones included",
        ),
        value("budget", "TIME", "stop refining when this time is used up"),
        VIEW,
        WAY,
        FARM,
        switch("keys", "write the key images too, as linear .exr"),
        OptionSpec {
            value: Some("DIR"),
            ..output("where the results go (default: out/ and the show's file name)")
        },
    ])
    .command(),
    verb(
        "compare",
        measure::compare,
        "render every bank alone and hold it against its reference picture",
        "compare --reference refs --quality 2 -o differences.png",
    )
    .options(&[
        value(
            "reference",
            "DIR",
            "the folder of BANK.exr, or of the halves BANK_A.exr and BANK_B.exr",
        ),
        QUALITY,
        JSON,
        output("write the differences as a .png or an .svg"),
    ])
    .command(),
    verb(
        "quality",
        measure::quality,
        "what each step of quality sets, and how long it is likely to take",
        "quality --measure",
    )
    .options(&[
        JSON,
        switch(
            "measure",
            "render at every step too, and tell the seconds it took",
        ),
    ])
    .command(),
    verb(
        "chart",
        measure::chart,
        "draw error against time over the steps of quality",
        "chart transport -o transport.png",
    )
    .kinds(CHARTS)
    .options(&[
        value(
            "reference",
            "DIR",
            "the folder of reference pictures (default: the finest step is the \
                 reference)",
        ),
        DARK,
        output("write a .png, an .svg, or the figures as .csv or .json"),
    ])
    .command(),
    verb(
        "pool",
        render::pool,
        "what pictures there are and which serve this show, or free them",
        "pool drop unused",
    )
    .words("[drop [unused | all]]", Complete::Nothing)
    .command(),
    verb(
        "view",
        text::view,
        "list the views, or make pictures from NAME from now on",
        "view stalls",
    )
    .words("[NAME]", Complete::Views),
    verb(
        "go",
        live::go,
        "run the next cue, and those that follow by themselves, to the end",
        "go",
    ),
    verb(
        "back",
        live::back,
        "back to the end of the cue before",
        "back",
    ),
    verb(
        "goto",
        live::goto,
        "to the end of a cue, or to where a part of its time has gone by",
        "goto 2.5 at 50%",
    )
    .words("CUE [at PART%]", Complete::Cues),
    verb(
        "set",
        live::set,
        "try levels without a cue; a move in time lets go of them",
        "set lamps 40 sky #203060",
    )
    .words("[LEVELS]", Complete::Levels),
    verb(
        "release",
        live::release,
        "let go of the levels that are tried",
        "release",
    ),
    verb(
        "record",
        live::record,
        "write the tried levels as a new cue; alone: keep blind edits",
        "record 2.5 \"Lamp up\" --time 3",
    )
    .words("[NUMBER [LABEL]]", Complete::Nothing)
    .options(&[value(
        "time",
        "TIME",
        "the new cue's time, such as 3 or 4/6",
    )]),
    verb(
        "update",
        live::update,
        "write the tried levels into the cue that stands",
        "update",
    ),
    verb(
        "insert",
        live::insert,
        "write the tried levels as a new cue behind the one that stands",
        "insert \"Lamp up\" --time 3",
    )
    .words("[LABEL]", Complete::Nothing)
    .options(&[value(
        "time",
        "TIME",
        "the new cue's time, such as 3 or 4/6",
    )]),
    verb(
        "delete",
        edit::delete,
        "take a cue or another declaration out",
        "delete cue 3",
    )
    .words("cue N | WORD NAME", Complete::Names),
    verb(
        "copy",
        edit::copy,
        "write a cue once more under another number",
        "copy cue 2 to 7",
    )
    .words("cue N to NUMBER", Complete::Cues),
    verb(
        "rename",
        edit::rename,
        "call something otherwise, wherever the show names it",
        "rename lamps to practicals",
    )
    .words("NAME to NEW", Complete::Names),
    verb(
        "blind",
        live::blind,
        "show edits but keep them only by `record`; `off` drops them",
        "blind",
    )
    .words("[off]", Complete::Nothing),
    verb("undo", text::undo, "take the last edit back", "undo"),
    verb(
        "redo",
        text::redo,
        "make the edit again that was taken back",
        "redo",
    ),
    verb(
        "tracksheet",
        text::tracksheet,
        "cues by banks: each bank's level; moved, tracked, blocked marked",
        "tracksheet -o tracks.csv",
    )
    .options(&[output("write a .md, .csv or .txt")])
    .command(),
    verb(
        "cuesheet",
        text::cuesheet,
        "what each cue does, when it starts and how long it takes",
        "cuesheet -o cues.md",
    )
    .options(&[output("write a .md, .csv or .txt")])
    .command(),
    verb(
        "export",
        export::export,
        "write the show for a desk or QLC+; tell what is lost",
        "export -o show.asc",
    )
    .options(&[JSON, output("write a .asc (USITT ASCII) or a .qxw (QLC+)")])
    .command(),
    verb(
        "fmt",
        text::fmt,
        "lay out the show's text, comments and groups kept",
        "fmt",
    )
    .options(&[switch("check", "only tell whether the layout is canonical")]),
    verb(
        "diff",
        text::diff,
        "what changed since the show was read or saved, or from FILE to it",
        "diff -o changes.png",
    )
    .words("[FILE]", Complete::Files)
    .options(&[output("draw the changed curves as a .png or an .svg")]),
    verb(
        "explain",
        text::explain,
        "what a message's code means, with a wrong sheet and its correction",
        "explain E012",
    )
    .words("CODE", Complete::Codes),
    verb(
        "save",
        text::save,
        "write the show's text, comments and layout kept",
        "save",
    )
    .words("[FILE]", Complete::Files),
    verb(
        "help",
        help::help,
        "list the verbs, or explain one",
        "help picture",
    )
    .words("[VERB]", Complete::Verbs),
    verb("quit", text::quit, "leave", "quit"),
];
