//! `footlight stage FILE`: the whole description of a stage's file.

use std::path::Path;
use std::process::Command;

use footlight_picture::png;

fn stage(folder: &Path, name: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .current_dir(folder)
        .args(["stage", name])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_gltf_file_is_described() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/errors");
    let wanted = "\
little.gltf: 1 x 0 x 1 m (across, deep, high), from 0, 0, 0 to 1, 0, 1
1 face becomes 1 polygon
lights: `Key` (spot), `Sun` (directional: cannot be used)
cameras: `Camera`
to begin with: view house from 0.5, -1.98, 0.92  to 0.5, 0, 0.5  fov 40

material  reflectance     m2
wall      1.00 1.00 1.00  0.5
";
    assert_eq!(stage(&folder, "little.gltf"), wanted);
}

/// A typical file with faults: a missing image, a face without a material, one of a missing
/// material, one without area.
#[test]
fn an_obj_file_is_described_with_what_is_not_as_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("cloth.png", &png::encode(2, 2, &[200; 12]).unwrap());
    write(
        "set.mtl",
        b"newmtl cloth\nKd 0.5 0.5 0.5\nmap_Kd cloth.png\nnewmtl gauze\nKd 0.4 0.4 0.4\nd 0.25\n\
          newmtl sign\nKd 0 0 0\nKe 9 9 9\nnewmtl lost\nKd 0.6 0.6 0.6\nmap_Kd gone.png\n",
    );
    write(
        "set.obj",
        b"mtllib set.mtl\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
          f 1 2 3\nusemtl cloth\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nusemtl gauze\nf 4 3 2 1\n\
          usemtl sign\nf 1 2 2\nf 1 3 4\nusemtl lost\nf 1/1 2/2 4/4\nusemtl nowhere\nf 2 3 4\n",
    );
    let wanted = "\
set.obj: 2 x 0 x 1 m (across, deep, high), from 0, 0, 0 to 2, 0, 1
7 faces become 7 polygons, 1 empty face left out
lights: none
cameras: none
not as it stands: faces without a material (`usemtl`): they are of `default`, which reflects 0.8
not as it stands: material `nowhere` (line 21) is not defined: it reflects 0.8
not as it stands: the texture of `lost`: `gone.png` does not exist; it reflects half of its factor, and `surface` can say more
to begin with: view house from 1, -3.13, 1.17  to 1, 0, 0.5  fov 40

material  reflectance     m2
cloth     0.29 0.29 0.29  2   texture 2x2
gauze     0.40 0.40 0.40  2   thinned by alpha
sign      0.00 0.00 0.00  1   shines 9.000 cd/m2
lost      0.30 0.30 0.30  1
default   0.80 0.80 0.80  1
nowhere   0.80 0.80 0.80  1
";
    assert_eq!(stage(folder.path(), "set.obj"), wanted);
}

/// `check` names transparent materials with the kind of transparency.
#[test]
fn check_tells_of_what_is_transparent() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "set.mtl",
        "newmtl gauze\nKd 0.8 0.8 0.8\nd 0.5\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n",
    );
    write(
        "set.obj",
        "mtllib set.mtl\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nusemtl gauze\nf 1 2 3 4\n\
         usemtl lamp\nf 1 4 5\n",
    );
    write(
        "a.lxq",
        "show \"A\"\nstage \"set.obj\"\nview v from 1, -3, 1 to 1, 0, 0 fov 40 size 32x18\n\
         light l panel lamp\nbank b = l\ncue 1 { b full }\n",
    );
    let output = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .current_dir(folder.path())
        .args(["check", "a.lxq"])
        .output()
        .unwrap();
    let wanted = "A: 1 bank, 1 cue, 5s\n`gauze` thinned by alpha\nno errors\n";
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        wanted,
        "{output:?}"
    );
}
