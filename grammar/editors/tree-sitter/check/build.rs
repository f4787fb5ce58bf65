//! Makes the parser from `grammar.js` by Node, and compiles it.

use std::path::PathBuf;

fn main() {
    println!("cargo::rerun-if-changed=../grammar.js");
    let grammar = PathBuf::from("../grammar.js");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo says where"));
    let mut said = Vec::new();
    let made = tree_sitter_generate::generate_parser_in_directory(
        "..",
        Some(&out),
        Some(grammar),
        15,
        None,
        Some("node"),
        true,
        tree_sitter_generate::OptLevel::default(),
        &mut said,
    );
    if let Err(error) = made {
        panic!("{error}");
    }
    let parser = out.join("parser.c");
    cc::Build::new()
        .include(&out)
        .file(&parser)
        .warnings(false)
        .compile("lxq");
    println!("cargo::rustc-env=LXQ_PARSER={}", parser.display());
}
