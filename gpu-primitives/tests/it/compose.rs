use gpu_primitives::wgsl::{ComposeError, Composed, Constant, Module, compose, compose_fixed};

const A: Module = Module { name: "a", source: "fn a() {}" };
const B: Module = Module { name: "b", source: "#import a\nfn b() { a(); }" };

fn entry(source: &'static str) -> Module {
    Module { name: "main", source }
}

fn text(source: &'static str, constants: &[(&str, Constant)]) -> String {
    compose(entry(source), &[A, B], constants).expect("composes").source
}

fn error(source: &'static str) -> ComposeError {
    compose(entry(source), &[A, B], &[]).expect_err("does not compose")
}

#[test]
fn a_module_is_included_once_before_its_importers() {
    let found = text("fn main() {}\n#import b\n#import a\n#import b // again\nfn end() {}", &[]);
    assert_eq!(found, "fn a() {}\nfn b() { a(); }\nfn main() {}\nfn end() {}\n");
}

#[test]
fn an_unknown_import_names_its_place() {
    let expected = ComposeError::UnknownImport { module: "main", line: 2, import: "zz".to_owned() };
    assert_eq!(error("\n#import zz"), expected);
    assert!(expected.to_string().starts_with("main:2:"));
}

#[test]
fn the_same_module_may_be_listed_twice_but_not_two_texts() {
    let other = Module { name: "a", source: "fn other() {}" };
    let same = compose(entry("#import a"), &[A, A], &[]).unwrap();
    assert_eq!(same.source, "fn a() {}\n");
    let error = compose(entry("#import a"), &[A, other], &[]).unwrap_err();
    assert!(matches!(error, ComposeError::AmbiguousImport { line: 1, .. }), "{error}");
}

#[test]
fn cycles_are_errors() {
    let x = Module { name: "x", source: "#import y" };
    let y = Module { name: "y", source: "fn y() {}\n#import x" };
    let error = compose(entry("#import x"), &[x, y], &[]).unwrap_err();
    assert_eq!(error, ComposeError::ImportCycle { chain: vec!["x", "y", "x"] });
    let own = Module { name: "own", source: "#import own" };
    let error = compose(own, &[own], &[]).unwrap_err();
    assert_eq!(error, ComposeError::ImportCycle { chain: vec!["own", "own"] });
}

#[test]
fn conditions_nest() {
    const SOURCE: &str = "\
#ifdef P
p
#ifdef Q
pq
#else
p!q
#endif
#else
!p
#ifndef Q
!p!q
#else
!pq
#endif
#endif
end";
    let (p, q) = (("P", Constant::U32(0)), ("Q", Constant::Bool(true)));
    let body = |constants: &[(&str, Constant)]| {
        let found = text(SOURCE, constants);
        let lines: Vec<String> =
            found.lines().filter(|line| !line.starts_with("const")).map(str::to_owned).collect();
        lines.join(" ")
    };
    assert_eq!(body(&[p, q]), "p pq end");
    assert_eq!(body(&[p]), "p p!q end");
    assert_eq!(body(&[q]), "!p !pq end");
    assert_eq!(body(&[]), "!p !p!q end");
    assert_eq!(body(&[("P", Constant::Bool(false))]), "!p !p!q end");
}

#[test]
fn imports_that_are_not_chosen_do_nothing() {
    let source = "#ifdef P\n#import nowhere\n#else\n#import a\n#endif";
    assert_eq!(text(source, &[]), "fn a() {}\n");
}

#[test]
fn conditions_must_pair_up() {
    let unbalanced = |line, directive| ComposeError::Unbalanced { module: "main", line, directive };
    assert_eq!(error("\n#endif"), unbalanced(2, "#endif"));
    assert_eq!(error("#else"), unbalanced(1, "#else"));
    assert_eq!(error("#ifdef P\n#else\n#else\n#endif"), unbalanced(3, "#else"));
    assert_eq!(error("#ifdef P\n#endif\n#ifndef Q\nx"), unbalanced(3, "#ifndef"));
}

#[test]
fn odd_directives_are_errors() {
    for source in ["#define X", "#import", "#import a b", "#ifdef", "#endif x", "#"] {
        assert!(
            matches!(error(source), ComposeError::UnknownDirective { line: 1, .. }),
            "{source}"
        );
    }
}

#[test]
fn constants_become_declarations() {
    let found = text(
        "",
        &[
            ("COUNT", Constant::U32(u32::MAX)),
            ("LEAST", Constant::I32(i32::MIN)),
            ("SMALL", Constant::F32(-1e-7)),
            ("WHOLE", Constant::F32(2.0)),
            ("OFF", Constant::Bool(false)),
        ],
    );
    let expected = "const COUNT: u32 = 4294967295u;\nconst LEAST: i32 = -2147483648;\n\
        const SMALL: f32 = -1e-7f;\nconst WHOLE: f32 = 2.0f;\nconst OFF: bool = false;\n";
    assert_eq!(found, expected);
    let module = naga::front::wgsl::parse_str(&found).unwrap();
    assert_eq!(module.constants.len(), 5);
}

#[test]
fn odd_constants_are_errors() {
    let error = |constants: &[(&str, Constant)]| compose(entry(""), &[], constants).unwrap_err();
    for name in ["", "_", "__x", "1x", "a-b", "a b"] {
        let error = error(&[(name, Constant::U32(1))]);
        assert!(matches!(error, ComposeError::Constant { .. }), "{name}");
    }
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(matches!(error(&[("X", Constant::F32(value))]), ComposeError::Constant { .. }));
    }
    let twice = [("X", Constant::U32(1)), ("X", Constant::U32(1))];
    assert!(matches!(error(&twice), ComposeError::Constant { .. }));
}

#[test]
fn every_line_knows_its_origin() {
    let source = "enable f16;\n#import b\n#ifdef Q\nskipped\n#endif\nfn main() {}";
    let found = compose(entry(source), &[A, B], &[("N", Constant::U32(3))]).unwrap();
    let expected = "enable f16;\nconst N: u32 = 3u;\nfn a() {}\nfn b() { a(); }\nfn main() {}\n";
    assert_eq!(found.source, expected);
    let origins: Vec<_> = (0..=6).map(|line| found.origin(line)).collect();
    let expected =
        [None, Some(("main", 1)), None, Some(("a", 1)), Some(("b", 2)), Some(("main", 6)), None];
    assert_eq!(origins, expected);
}

#[test]
fn a_fixed_text_that_does_not_compose_does_not_parse() {
    let good: Composed = compose_fixed(entry("#import a"), &[A], &[]);
    assert_eq!(good.source, "fn a() {}\n");
    let bad = compose_fixed(entry("#import zz"), &[A], &[]);
    assert!(bad.source.contains("zz"));
    assert!(naga::front::wgsl::parse_str(&bad.source).is_err());
}
