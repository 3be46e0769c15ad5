//! Wrong usage, and help.

use crate::support::Folder;

#[test]
fn wrong_usage_exits_with_2() {
    let folder = Folder::new();
    let wrong = [
        "",
        "fly",
        "convert",
        "convert a.obj",
        "convert -o a.rsp",
        "convert a.obj -o a.rsp --page-size 2M",
        "convert a.obj -o a.rsp --strip-windows 0",
        "convert a.obj -o a.rsp --frobnicate",
        "render a.obj",
        "render a.obj -o a.png --size 0x10",
        "render a.obj -o a.png --size 10",
        "render a.obj -o a.png --spp 0",
        "render a.obj -o a.png --integrator magic",
        "trace a.rsp",
        "trace a.rsp --rays r --threads 0",
        "info",
        "verify",
        "verify a.rsp b.rsp",
    ];
    for arguments in wrong {
        let outcome = folder.run(arguments);
        assert_eq!(outcome.code, Some(2), "{outcome:#?}");
        assert!(outcome.stdout.is_empty() && !outcome.stderr.is_empty(), "{outcome:#?}");
    }
    assert!(folder.names("").is_empty());
}

#[test]
fn help_and_version() {
    let folder = Folder::new();
    let help = folder.run("--help").done().stdout;
    for verb in ["convert", "render", "trace", "info", "verify"] {
        assert!(help.contains(verb), "{help}");
        let of_verb = folder.run(&format!("{verb} --help")).done().stdout;
        assert!(of_verb.contains("Usage: raystrips"), "{of_verb}");
    }
    assert!(folder.run("--version").done().stdout.starts_with("raystrips "));
}
