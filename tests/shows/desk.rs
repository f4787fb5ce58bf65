//! Shows survive export to a desk's file and import.

use std::fs;
use std::path::PathBuf;

use footlight_desk::usitt;
use footlight_host::files::Folder;
use footlight_host::work::Work;
use footlight_show::diagnostic::Sources;
use footlight_show::lang;
use footlight_show::model::Show;
use footlight_show::timeline::Timeline;

fn parsed(name: &str, text: &str) -> Show {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let folder = folder.join(name.rsplit_once('/').map_or("", |(folder, _)| folder));
    let files = Folder::new(&folder, 16 << 20);
    let parsed = lang::parse_with_files(&files, &mut Sources::default(), name, text);
    parsed.show.unwrap()
}

/// By cue and channel, levels in percent when the cue is complete and not overtaken.
fn levels(show: &Show) -> Vec<Vec<(u32, f64)>> {
    let mut held = vec![0.0; show.parameters().len()];
    let moves = footlight_show::timeline::cue_moves(show).unwrap();
    let mut out = Vec::new();
    for moves in moves {
        for one in moves {
            held[one.parameter] = one.motion.target();
        }
        let banks = show.banks.iter().zip(show.first_parameters());
        let lit = banks.filter(|(_, first)| held[*first] > 0.0);
        let lit = lit.map(|(bank, first)| (bank.channel.unwrap(), 100.0 * held[first]));
        let mut lit: Vec<_> = lit.collect();
        lit.sort_by_key(|(channel, _)| *channel);
        out.push(lit);
    }
    out
}

#[test]
fn the_examples_go_to_a_desk_and_come_back() {
    for name in ["tavern/tavern.lxq", "turandot/turandot.lxq"] {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join("examples")
            .join(name);
        let show = parsed(name, &fs::read_to_string(path).unwrap());
        let carried = usitt::write(&show, &Timeline::new(&show).unwrap(), Work::silent()).unwrap();
        let (_, back) = usitt::import("back.asc", carried.text.as_bytes(), None, Work::silent());
        let back = back.unwrap();
        let (before, after) = (levels(&show), levels(&parsed("back.lxq", &back.text)));
        assert_eq!(before.len(), after.len(), "{name}");
        for (cue, (before, after)) in before.iter().zip(&after).enumerate() {
            let channels = |list: &[(u32, f64)]| list.iter().map(|c| c.0).collect::<Vec<_>>();
            assert_eq!(channels(before), channels(after), "{name}, cue {cue}");
            for ((channel, a), (_, b)) in before.iter().zip(after) {
                assert!(
                    (a - b).abs() < 0.2,
                    "{name}, cue {cue}, channel {channel}: {a} {b}"
                );
            }
        }
        // No cue loses anything.
        let mut losses = back.losses.iter();
        assert!(losses.all(|loss| loss.cue.is_none()), "{:?}", back.losses);
    }
}
