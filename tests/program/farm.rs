//! Task lists: workers that share a folder, one of them killed; refused lists; a farm that loses
//! tasks.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::thread::sleep;
use std::time::{Duration, Instant};

use footlight_engine::{Engine, Goal, Host, LEASE, PoolPlace, Refinement, Way, Worked};
use footlight_host::files::{Disk, Folder};
use footlight_picture::exr;
use footlight_report::farm::{Farm, refine};
use footlight_report::tasks;

const SHOW: &str = "show \"Farm\"
preview { tolerance 1%  coarse 1  refined 2 }
view house from 0,-5,2 to 0,0,0.5 fov 40 size 64x36
surface floor reflectance 0.5 box from -3,-3,-1 to 3,3,0
surface block reflectance 0.6 box from -0.5,-0.5,0 to 0.5,0.5,1
light left spot at -2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
light right spot at 2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
light top spot at 0,0,4 aim 0,0,0 beam 30 field 60 900 cd
bank a = left
bank b = right
bank c = top
cue 1 at 0:00 { snap  a 80  b 10 }
cue 2 at 0:02 { time 2  a 15  b 90 }
cue 3 at 0:05 { time 2  b 20  c 70 }
";

fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.lxq"), SHOW).unwrap();
    folder
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    command.current_dir(folder).args(line.split_whitespace());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The exit code and the output.
fn finish(child: Child) -> (i32, String) {
    let output = child.wait_with_output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (
        output.status.code().unwrap_or(-1),
        String::from_utf8(said).unwrap(),
    )
}

fn footlight(folder: &Path, line: &str) -> (i32, String) {
    finish(command(folder, line).spawn().unwrap())
}

/// The name of a stored image, its header attributes and its pixels.
type Stored = (String, Vec<(String, String)>, Vec<u32>);

/// Every image of a pool, sorted by name. The order of attributes differs between files.
fn pictures(pool: &Path) -> Vec<Stored> {
    let scenes = fs::read_dir(pool.join("pictures")).unwrap();
    let files = scenes.flat_map(|scene| fs::read_dir(scene.unwrap().path()).unwrap());
    let read = |file: std::io::Result<fs::DirEntry>| {
        let path = file.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let bytes = fs::read(path).unwrap();
        let mut header = exr::attributes(&bytes).unwrap();
        header.sort();
        let image = exr::decode(&bytes, 1 << 24).unwrap();
        let pixels = image.data().iter().map(|x| x.to_bits()).collect();
        (name, header, pixels)
    };
    let mut out: Vec<Stored> = files.map(read).collect();
    out.sort();
    out
}

fn claims(pool: &Path) -> usize {
    fs::read_dir(pool.join("claims")).map_or(0, Iterator::count)
}

fn wait_for(what: impl Fn() -> bool) {
    let since = Instant::now();
    while !what() {
        assert!(since.elapsed().as_secs() < 60, "it does not come");
        sleep(Duration::from_millis(1));
    }
}

#[test]
fn of_three_workers_one_is_killed_and_its_picture_comes_once() {
    let folder = place();
    let (code, said) = footlight(folder.path(), "plan s.lxq --way paper --tasks tasks.json");
    assert!(code == 0 && said.contains("3 tasks"), "{said}");
    let (code, said) = footlight(folder.path(), "work tasks.json --pool serial --quiet");
    assert_eq!(
        (code, said.matches("rendered in").count()),
        (0, 3),
        "{said}"
    );

    let pool = folder.path().join(".footlight");
    let work = || command(folder.path(), "work tasks.json --lease 1s");
    let mut killed = work().spawn().unwrap();
    wait_for(|| claims(&pool) > 0);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let others = [work().spawn().unwrap(), work().spawn().unwrap()];
    let ended = others.map(finish);
    let mut rendered = 0;
    for (code, said) in &ended {
        assert!([0, 75].contains(code), "{said}");
        rendered += said.matches("rendered in").count();
    }
    // After the lease, any worker steals the dead one's claim.
    let begin = Instant::now();
    while footlight(folder.path(), "collect tasks.json").0 != 0 {
        assert!(begin.elapsed().as_secs() < 30);
        sleep(Duration::from_millis(100));
        let (code, said) = footlight(folder.path(), "work tasks.json --lease 1s");
        assert!([0, 75].contains(&code), "{said}");
        rendered += said.matches("rendered in").count();
    }
    // The killed worker had begun one: at most that many are rendered beyond the three.
    let (kills, wasted) = (1, rendered + 1 - 3);
    assert!(wasted <= kills + 1, "{rendered}");
    assert!(pictures(&pool) == pictures(&folder.path().join("serial")));
    assert_eq!(claims(&pool), 0);
    for number in ["", " 3"] {
        let (code, said) = footlight(folder.path(), &format!("work tasks.json{number}"));
        assert!(code == 0 && !said.contains("rendered"), "{said}");
    }
    let (code, said) = footlight(folder.path(), "plan s.lxq --way paper --tasks next.json");
    assert!(code == 0 && said.contains("mixtures of the plan"), "{said}");
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_rendered() {
    let folder = place();
    footlight(folder.path(), "plan s.lxq --way paper --tasks tasks.json");
    let list = fs::read_to_string(folder.path().join("tasks.json")).unwrap();
    let cases = [
        (
            list.replace("\"radiosity ", "\"radiosity x"),
            "another renderer",
        ),
        (list.replace("\"1 0 0\"", "\"2 0 0\""), "another light"),
        (
            list.replace("\"schema\":0", "\"schema\":7"),
            "its schema is 7",
        ),
        (
            list.replace("\"1 0 0\"", "\"1 0 zero\""),
            "no list of tasks",
        ),
        (
            list.replace("\"1 0 0\"", "\"1 0 inf\""),
            "does not fit the coordinates",
        ),
        (list.replace("\"1-", "\"../1-"), "no address"),
        (
            list.replace("\"task\":2", "\"task\":5"),
            "task 2 has another number",
        ),
        ("{}".to_owned(), "no list of tasks"),
    ];
    for (text, words) in cases {
        assert_ne!(text, list, "{words}");
        fs::write(folder.path().join("other.json"), text).unwrap();
        let (code, said) = footlight(folder.path(), "work other.json 1");
        assert!(code == 65 && said.contains(words), "{words}: {code} {said}");
    }
    let moved = SHOW.replace("from 0,-5,2", "from 0,-5,2.1");
    fs::write(folder.path().join("s.lxq"), moved).unwrap();
    let (code, said) = footlight(folder.path(), "work tasks.json");
    assert!(
        code == 65 && said.contains("another scene or view"),
        "{said}"
    );
    let (code, said) = footlight(folder.path(), "work tasks.json 7");
    assert!(code == 2 && said.contains("they are 1 to 3"), "{said}");
    let (code, said) = footlight(folder.path(), "collect tasks.json --json");
    let json: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((code, &json["there"]), (75, &0.into()), "{said}");
    assert!(!folder.path().join(".footlight/pictures").exists());
    let (code, said) = footlight(folder.path(), "plan s.lxq --tasks t.json --pool off");
    assert!(code == 2 && said.contains("stored nowhere"), "{said}");
    let (code, said) = footlight(folder.path(), "plan s.lxq --tasks s.lxq");
    assert!(code == 2 && said.contains("belongs to the show"), "{said}");
}

/// Planning enforces the pool's limit.
#[test]
fn a_pool_that_is_too_small_is_refused_when_planning() {
    let folder = place();
    let show = SHOW.replace("64x36", "640x360");
    fs::write(folder.path().join("s.lxq"), show).unwrap();
    let (code, said) = footlight(folder.path(), "plan s.lxq --tasks t.json --pool-limit 5");
    assert!(code == 2 && said.contains("--pool-limit"), "{code} {said}");
}

/// A failing renderer, and a stopped one.
#[cfg(unix)]
#[test]
fn a_failure_is_written_down_and_a_stopped_worker_gives_its_claim_up() {
    use nix::sys::signal::{Signal, kill};

    let folder = place();
    let options = ["--renderer-version", "v1", "--renderer"];
    let call = |line: &str, renderer: &str| {
        let mut command = command(folder.path(), line);
        command.args(options).arg(renderer);
        command
    };
    let fails = "sh -c 'echo no licence >&2; exit 4' {settings} {output}";
    let hangs = "sh -c 'sleep 600' {settings} {output}";
    let (code, said) = finish(call("plan s.lxq --tasks t.json", fails).spawn().unwrap());
    assert!(
        code == 0 && said.contains("3 tasks, of banks alone\n"),
        "{said}"
    );
    let (code, said) = finish(call("work t.json 2", fails).spawn().unwrap());
    assert!(code == 3 && said.contains("no licence"), "{code} {said}");
    let (_, said) = footlight(folder.path(), "collect t.json");
    assert!(
        said.contains("task 2    failed on ") && said.contains("no licence"),
        "{said}"
    );
    // Without its version, or with another one, it is another renderer.
    let (code, said) = footlight(folder.path(), "work t.json 2");
    assert!(
        code == 65 && said.contains("outside v1, of 1 steps"),
        "{said}"
    );

    let claim = || {
        let names = fs::read_dir(folder.path().join(".footlight/claims"));
        let mut names = names.into_iter().flatten().flatten();
        names.any(|entry| entry.path().extension().is_some_and(|e| e == "0"))
    };
    for (signal, wanted) in [(Signal::SIGINT, 130), (Signal::SIGTERM, 143)] {
        let child = call("work t.json 1", hangs).spawn().unwrap();
        wait_for(claim);
        let (code, said) = footlight(folder.path(), "collect t.json");
        assert!(
            code == 75 && said.contains("is being rendered by process"),
            "{said}"
        );
        let process = nix::unistd::Pid::from_raw(child.id().cast_signed());
        kill(process, signal).unwrap();
        let (code, said) = finish(child);
        assert_eq!(code, wanted, "{said}");
        assert!(!claim(), "{said}");
    }
}

/// A farm in this process that works backwards and loses the second task of its first job.
struct Lossy {
    pool: PathBuf,
    jobs: Mutex<Vec<Vec<usize>>>,
    loses: bool,
    works: bool,
}

fn engine(show: &Path, pool: &Path) -> Engine {
    let host = Host {
        files: Box::new(Folder::new(show.parent().unwrap(), 1 << 20)),
        pool: Some(PoolPlace {
            folder: pool.to_owned(),
            limit: 1 << 30,
        }),
        ..Host::default()
    };
    Engine::open(show, host).unwrap()
}

impl Farm for Lossy {
    fn submit(&self, list: &Path, tasks: &[usize]) -> Result<String, String> {
        let mut jobs = self.jobs.lock().unwrap();
        jobs.push(tasks.to_vec());
        let list = tasks::read(&Disk, list).unwrap();
        assert!(list.pool.ends_with(self.pool.file_name().unwrap()));
        let mut worker = engine(&list.show, &list.pool);
        list.check_for(&worker).unwrap();
        for task in list.tasks.iter().rev().filter(|_| self.works) {
            let lost = self.loses && jobs.len() == 1 && task.task == 2;
            if tasks.contains(&task.task) && !lost {
                let done = list.work_on(&mut worker, task, LEASE).unwrap();
                assert!(matches!(done, Worked::Rendered(_)));
            }
        }
        Ok(jobs.len().to_string())
    }

    fn queued(&self, _: &str) -> Result<BTreeSet<usize>, String> {
        Ok(BTreeSet::new())
    }

    fn cancel(&self, _: &str) {}

    fn rest(&self, _: &dyn Fn() -> bool) {}
}

#[test]
fn a_farm_that_works_backwards_and_loses_tasks_leaves_the_same_pictures() {
    let folder = place();
    let show = folder.path().join("s.lxq");
    let farm = |name: &str, loses, works| Lossy {
        pool: folder.path().join(name),
        jobs: Mutex::default(),
        loses,
        works,
    };
    let alone = folder.path().join("alone");
    let mut serial = engine(&show, &alone);
    let by_mixtures = |goal: Goal| Refinement::from(goal).by(Way::Paper);
    serial.coarse_for(by_mixtures(Goal::count(0))).unwrap();

    let lossy = farm("lossy", true, true);
    let mut far = engine(&show, &lossy.pool);
    let rendered = refine(&mut far, by_mixtures(Goal::until(0.01)), &lossy).unwrap();
    let jobs = lossy.jobs.into_inner().unwrap();
    assert_eq!(jobs[..2], [vec![1, 2, 3], vec![2]], "{jobs:?}");
    let stored = pictures(&lossy.pool);
    assert_eq!(
        (rendered, stored.len()),
        (3 + far.estimate().refined(), rendered)
    );
    assert!(far.estimate().refined() > 0 && far.estimate().steps().len() > 1);
    // The rest of the goal exists and needs no rendering.
    far.refine(by_mixtures(Goal::until(0.01))).unwrap();
    assert_eq!(far.images().statistics().rendered, 0);
    // Images of single banks are equal files; mixtures are planned in one step there.
    let own = pictures(&alone);
    let coarse = stored.iter().filter(|(name, ..)| !name.starts_with('2'));
    assert!(coarse.clone().count() == 3 && coarse.into_iter().all(|one| own.contains(one)));
    assert!(
        fs::read_dir(lossy.pool.join("tasks"))
            .unwrap()
            .next()
            .is_none()
    );

    let idle = farm("idle", false, false);
    let error = refine(
        &mut engine(&show, &idle.pool),
        Goal::until(0.01).into(),
        &idle,
    )
    .unwrap_err();
    assert!(error.to_string().contains("3 times"), "{error}");
    assert_eq!(idle.jobs.into_inner().unwrap().len(), 3);
}

/// A stranger's list stores nothing outside its show's folder, unless the worker names the folder.
#[test]
fn a_strangers_list_writes_below_its_show_alone() {
    let folder = place();
    let (code, said) = footlight(folder.path(), "plan s.lxq --tasks tasks.json");
    assert_eq!(code, 0, "{said}");
    let list = folder.path().join("tasks.json");
    let text = fs::read_to_string(&list).unwrap();
    let outside = tempfile::tempdir().unwrap();
    let elsewhere = outside.path().join("deep");
    let absolute = elsewhere.display().to_string();
    for pool in [absolute.as_str(), "../elsewhere", "a/../../elsewhere"] {
        fs::write(
            &list,
            text.replace("\".footlight\"", &format!("\"{pool}\"")),
        )
        .unwrap();
        let (code, said) = footlight(folder.path(), "work tasks.json");
        assert!(
            code == 2 && said.contains("outside the show's folder"),
            "{pool}: {code} {said}"
        );
    }
    assert!(!elsewhere.exists());
    fs::write(
        &list,
        text.replace("\".footlight\"", &format!("\"{absolute}\"")),
    )
    .unwrap();
    let (code, said) = footlight(folder.path(), &format!("work tasks.json --pool {absolute}"));
    assert!(code == 0 && elsewhere.exists(), "{code} {said}");
}
