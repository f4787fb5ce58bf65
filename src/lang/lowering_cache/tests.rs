use super::*;
use crate::diagnostic::Sources;
use crate::files::Memory;
use crate::lang::{parse, parse_again, scan};
use proptest::prelude::*;

/// What is known of a text never changes what a text means: each of these is read after the others,
/// with and without a memory.
#[test]
fn a_text_read_again_means_the_same() {
    let rig = "show \"A\"\nlight l panel m\nlight n panel o\nbank a = l\nbank b = n rgb\n";
    let curve = "curve dawn = spline 0 0, 0.4 8, 1 100\nlook night { a 10 }\n";
    let cues = "cue 1 \"one\" at 0:01 { snap a 30  b #304050\n follow 9 }\n\
        cue 2 { a 60 time 3\n part 4 { delay 2 curve dawn\n b.r 20 } }\n\
        cue 3.5 { night  b linear 0 #000000, 4 #ffffff repeat 2\n hang -1 cueonly }\ncue 4 { }\n\
        cue 5 { blackout }\n";
    let whole = format!("{rig}{curve}{cues}");
    let texts = [
        whole.clone(),
        whole.replace("a 60", "a 61"),
        format!("// moved down\n\n{whole}"),
        whole.replace("cue 3.5", "  cue 3"),
        whole.replace("cue 4 { }", ""),
        whole.replace("look night { a 10 }", "look night { a 11 }"),
        whole
            .replace("bank a = l\n", "")
            .replace("bank b = n rgb", "bank b = n rgb\nbank a = l"),
        whole.replace("bank a = l", "bank c = l"),
        whole.replace("cue 5", "cue 2"),
        whole.replace("a 60", "a 600"),
        whole.replace("cue 4 { }", "cue 4 {\n a 20\n b =\n}"),
        format!("{cues}{rig}{curve}"),
        format!("{rig}{curve}default time 2\n{cues}"),
        whole.clone(),
        whole.replace("light n panel o", "light n panel p"),
        whole.replace("light n panel o", "light /* the */ night panel o"),
        whole.replace(
            "light n panel o",
            "light n panel o\nfixed exit = n  level 5",
        ),
        whole.replace("light n panel o", "light n pan o"),
        whole.replace("bank b = n rgb", "bank b = n  dimmer square rgb"),
        whole.replace("bank b = n rgb", "bank b = n // rgb"),
        whole.replace("bank a = l", "bank a = l rgb"),
        whole.clone(),
        // What is lowered while a declaration is broken is not kept.
        whole
            .replace("bank a = l", "bank a = l chan")
            .replace("b #304050", "b #304051"),
        whole.replace("b #304050", "b #304051"),
        whole
            .replace("look night { a 10 }", "look night { a 1")
            .replace("night  b lin", "night b lin"),
        whole.replace("night  b lin", "night b lin"),
        whole
            .replace("cue 4 { }", "cue 4 { c 3 }")
            .replace("a 30", "a 31"),
        whole.replace("a 30", "a 31"),
        whole.replace("show \"A\"", "show \"A\"  preview { gap 9 }"),
        whole.clone(),
    ];
    let mut known = LoweringCache::default();
    for (i, text) in texts.iter().enumerate() {
        let alone = parse(&mut Sources::default(), "t.lxq", text);
        for _ in 0..2 {
            let again = parse_again(
                &mut known,
                &Memory::default(),
                &mut Sources::default(),
                "t.lxq",
                text,
            );
            assert_eq!(again.show, alone.show, "text {i}");
            assert_eq!(again.spans.spans, alone.spans.spans, "text {i}");
            assert_eq!(again.diagnostics, alone.diagnostics, "text {i}");
        }
    }
}

proptest! {
    /// The same of any statements, some of them broken, one or another changed each time.
    #[test]
    fn any_text_read_again_means_the_same(
        start in prop::collection::vec(0_usize..4, STATEMENTS_OF_A_SHOW.len()),
        changes in prop::collection::vec((0..STATEMENTS_OF_A_SHOW.len(), 0_usize..4), 1..12),
    ) {
        let (mut known, mut chosen) = (LoweringCache::default(), start);
        for (statement, form) in changes {
            chosen[statement] = form;
            let each = STATEMENTS_OF_A_SHOW.iter().zip(&chosen);
            let text: String = each.map(|(forms, form)| format!("{}\n", forms[*form])).collect();
            let alone = parse(&mut Sources::default(), "t.lxq", &text);
            let files = Memory::default();
            let again = parse_again(&mut known, &files, &mut Sources::default(), "t.lxq", &text);
            prop_assert_eq!(again.show, alone.show, "{}", &text);
            prop_assert_eq!(again.spans.spans, alone.spans.spans, "{}", &text);
            prop_assert_eq!(again.diagnostics, alone.diagnostics, "{}", &text);
        }
    }
}

/// Each in four forms.
const STATEMENTS_OF_A_SHOW: [[&str; 4]; 18] = [
    [
        "light l panel m",
        "light l panel n",
        "light l pan",
        "light k panel m",
    ],
    [
        "light n panel m",
        "",
        "light n panel m 5 K",
        "light n panel m 900 cd/m2",
    ],
    [
        "bank a = l",
        "bank a = l rgb",
        "bank a = l chan",
        "bank a = l channel 3",
    ],
    ["bank b = n", "bank b = n  dimmer square", "bank b", ""],
    [
        "",
        "bank c = n",
        "bank a2 = n rgb",
        "curve rise = linear 0 0, 1 100",
    ],
    [
        "bank d = l",
        "bank d = l\n // rgb\n rgb",
        "bank d = l\n // rgb",
        "bank dd = l",
    ],
    [
        "curve dawn = linear 0 0, 0.4 8, 1 100",
        "curve dawn = linear 0 0, 1 90",
        "curve noon = linear 0 0, 1 100",
        "effect glow = pulse",
    ],
    [
        "effect fire = flicker",
        "effect fire = pulse  rate 2",
        "effect fire",
        "curve dawn = linear 0 0, 1 100",
    ],
    [
        "group ab = a b",
        "group ab = b",
        "group ab =",
        "group ab = a",
    ],
    ["let v = 5", "let v = 6", "let v", ""],
    [
        "look low { ab 5 }",
        "look low { a (v) }",
        "look low { ab 5",
        "look low { b 7 }",
    ],
    [
        "look high = low + { b 9 }",
        "look high { b 8 }",
        "look high = lo",
        "look low { b 1 }",
    ],
    ["default time 3", "", "default time (v)", "default time x"],
    [
        "cue 1 { a 50 }",
        "cue 1 { a 50 b 20 }",
        "cue 1 { b 2 }",
        "cue 1 { x 5 }",
    ],
    [
        "cue 2 { high }",
        "cue 2 { low  time 2 }",
        "cue 2 { ab 30 }",
        "cue 2 { ab }",
    ],
    [
        "cue 4 { d 30 curve dawn  a 20 effect fire }",
        "cue 4 { up 3  d 5  part 2 { down (2s-v)  a 7 } }",
        "cue 4 { d 5 time (v)  ab 7 effect fire }",
        "cue 4 { delay 1  d 4  a 9 up 2 }",
    ],
    [
        "cue 5 { snap  d 30  a 3 down 1 curve rise }",
        "cue 5 { dd 4  part 3 { a 5 } }",
        "cue 5 { d 9  blackout }",
        "cue 5 { c 5 curve noon }",
    ],
    [
        "cue 3 { b 5 }",
        "cue 3 { high 50 }",
        "cue 1 { b 5 }",
        "cue 3 { blackout }",
    ],
];

/// What every cue below names.
const DECLARATIONS: &str = "gels \"g.csv\"\ngroup ab = a b\nlet v = 5\n\
    curve dawn = linear 0 0, 0.4 8, 1 100\nlook low { e 5 }\nlook high = low + { c (v) }\n\
    default time 3\ninclude \"i.lxq\"\n";

/// They come first or last in the show, and some give a word of warning each time.
const NAMING_ALL: &str = "light l panel m\nbank a = l\nbank b = l\nbank c = l rgb\nbank d = l rgb\n\
    bank e = l\nbank f = l\n\
    cue 1 { up 2 curve dawn\n high\n ab (v)\n d #203060 }\n\
    cue 2 { d gel L1 (v) curve dawn\n low 50 }\n\
    cue 3 \"Ü\" { time (v) high  ab (v) curve dawn\n later }\n\
    cue 4 { part 2 { curve dawn  low + { c (v) } }\n part 3 { d (v) delay (v) } }\n\
    cue 5 { ab (v)  high  time 4 }\n";

proptest! {
    /// The same of keystrokes in what all cues name, one after the other, some of them taken back.
    #[test]
    fn keystrokes_in_what_all_cues_name_mean_the_same(
        is_first in any::<bool>(),
        keys in prop::collection::vec((any::<prop::sample::Index>(), 0..KEYS.len(), any::<bool>()), 1..24),
    ) {
        let files = files_of_all();
        let (mut known, mut typed) = (LoweringCache::default(), DECLARATIONS.to_owned());
        for (place, key, is_kept) in keys {
            let before = typed.clone();
            let places: Vec<usize> = typed.char_indices().map(|(at, _)| at).collect();
            let at = *place.get(&places);
            match KEYS[key] {
                "" => drop(typed.remove(at)),
                key => typed.insert_str(at, key),
            }
            for text in [typed.clone(), if is_kept { typed.clone() } else { before.clone() }] {
                let text = if is_first { format!("{text}{NAMING_ALL}") } else { format!("{NAMING_ALL}{text}") };
                let parsed = |cache: &mut LoweringCache| {
                    parse_again(cache, &files, &mut Sources::default(), "t.lxq", &text)
                };
                let (again, alone) = (parsed(&mut known), parsed(&mut LoweringCache::default()));
                prop_assert_eq!(again.show, alone.show, "{}", &text);
                prop_assert_eq!(again.spans.spans, alone.spans.spans, "{}", &text);
                prop_assert_eq!(again.diagnostics, alone.diagnostics, "{}", &text);
                prop_assert_eq!(again.left_out, alone.left_out, "{}", &text);
            }
            if !is_kept {
                typed = before;
            }
        }
    }
}

fn files_of_all() -> Memory {
    let gels = Memory::default().with("g.csv", "L1, Blue, #9dc1ff\n");
    gels.with("i.lxq", "look later { f 4 }\n")
}

/// What is typed; nothing takes a character away.
const KEYS: [&str; 14] = [
    "", "", "", "x", "{", "}", "\"", " ", "7", "\n", "a", "=", "//", "f 3 ",
];

/// The text of the show above has no error, so that its cues are kept.
#[test]
fn the_show_of_which_all_cues_name_the_same_is_sound() {
    let files = files_of_all();
    let (mut known, text) = (
        LoweringCache::default(),
        format!("{DECLARATIONS}{NAMING_ALL}"),
    );
    let mut sources = Sources::default();
    let read = parse_again(&mut known, &files, &mut sources, "t.lxq", &text);
    assert!(read.show.is_some(), "{:?}", read.diagnostics);
    // With a look that is another, no cue is taken as it was lowered, and all as they were parsed.
    let found = environment(&text.replace("e 5", "e 6"));
    let found = known.within(&found);
    let cues: Vec<&str> = known.cues.keys().map(String::as_str).collect();
    assert_eq!(cues.len(), 5);
    assert!(cues.iter().all(|cue| found.parsed(cue).is_some()));
}

/// The budget of levels is spent by known cues too.
#[test]
fn a_known_cue_costs_what_it_did() {
    let rig = "light l panel m\nbank a = l rgb\n";
    let text = format!("{rig}cue 1 {{ blackout }}\ncue 2 {{ blackout }}\n");
    let mut known = LoweringCache::default();
    parse_again(
        &mut known,
        &Memory::default(),
        &mut Sources::default(),
        "t.lxq",
        &text,
    );
    let within = |text: &str| {
        let environment = environment(text);
        let found = known.within(&environment);
        found.cue("cue 2 { blackout }").map(|cue| cue.levels())
    };
    assert_eq!(within(rig), Some(1));
    // The lights of a bank, and where they hang, are nothing to a cue.
    assert_eq!(within(&rig.replace("panel m", "panel n")), Some(1));
    assert_eq!(within("light l panel m\nbank a = l\n"), None);
}

/// With 2,000 cues an edit of a look costs those that name it, or a look that rests on it.
#[test]
fn a_look_costs_the_cues_that_rest_on_it() {
    let rig = "light l panel m\nbank a = l\nbank b = l\nlook night { a 5 }\n\
               look late = night + { b 5 }\nlook noon { b 9 }\n";
    let cues = "cue 1 { night }\ncue 2 { late }\ncue 3 { noon }\ncue 4 { a 3 }\n";
    let (mut known, text) = (LoweringCache::default(), format!("{rig}{cues}"));
    let mut read = |text: &str| {
        let mut sources = Sources::default();
        parse_again(&mut known, &Memory::default(), &mut sources, "t.lxq", text).show
    };
    assert!(read(&text).is_some());
    // An error forgets nothing.
    assert!(read(&text.replace("look noon {", "look noon")).is_none());
    let kept = |rig: &str| -> Vec<bool> {
        let environment = environment(rig);
        let found = known.within(&environment);
        let kept = cues.lines().map(|cue| found.cue(cue).is_some());
        kept.collect()
    };
    assert_eq!(kept(&rig.replace("a 5", "a 6")), [false, false, true, true]);
    // So does one of a bank, and a statement that is broken off; the default time costs none.
    assert_eq!(
        kept(&rig.replace("bank b", "bank bb")),
        [true, false, false, true]
    );
    assert_eq!(
        kept(&rig.replace("bank a", "xbank a")),
        [false, false, true, false]
    );
    assert_eq!(kept(&format!("{rig}default time 9\n")), [true; 4]);
}

fn environment(text: &str) -> Environment {
    let mut environment = Environment::default();
    scan::scan(text)
        .cuts
        .iter()
        .for_each(|cut| environment.add(cut));
    environment
}
