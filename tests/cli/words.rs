//! Help, JSON, exit status, and words that mean nothing.

use crate::{Desk, NO_ADAPTER};
use serde_json::Value;

const COMMANDS: [&str; 12] = [
    "new",
    "render",
    "preview",
    "watch",
    "check",
    "explain",
    "techniques",
    "bake",
    "layers",
    "media",
    "cache",
    "doctor",
];

#[test]
fn without_words_it_says_what_it_is_a_first_session_and_the_rest() {
    let said = Desk::new().run(&[]).ok();
    assert!(said.out.starts_with("Diaphane renders translucent things"), "{}", said.out);
    assert_eq!(said.out.lines().filter(|line| line.starts_with("  diaphane ")).count(), 6);
    for command in COMMANDS {
        assert!(said.out.contains(&format!("\n  {command} ")), "{command}");
    }
    assert!(said.err.is_empty());
}

#[test]
fn every_command_of_the_first_session_works() {
    let desk = Desk::new();
    let said = desk.run(&[]).out;
    let session: Vec<&str> = said.lines().filter_map(|line| line.strip_prefix("  diaphane ")).collect();
    let draws = desk.draws();
    for line in session {
        let words: Vec<&str> = line.split("  ").next().unwrap().split(' ').collect();
        // A window needs a desktop, and has tests of its own.
        if words[0] == "preview" {
            continue;
        }
        // Small, but otherwise as it stands.
        let words = if words[0] == "render" { [&words[..], &["--size", "16x12"]].concat() } else { words };
        if draws || words[0] != "render" {
            let ran = desk.run(&words).ok();
            assert!(ran.err.is_empty(), "{ran:#?}");
        }
    }
    assert_eq!(desk.path("pebble.png").is_file(), draws);
}

#[test]
fn every_command_has_help_and_every_flag_of_it_says_what_it_does() {
    let desk = Desk::new();
    let all = desk.run(&["--help"]).ok();
    assert_eq!(all.out, desk.run(&["help"]).ok().out);
    assert_eq!(all.out, desk.run(&[]).ok().out);
    let nested = ["media list", "media show", "media profile", "cache stat", "cache clear"];
    for command in COMMANDS.iter().chain(&nested) {
        let words: Vec<&str> = command.split(' ').collect();
        let help = desk.run(&[&words[..], &["--help"]].concat()).ok();
        assert_eq!(help.out, desk.run(&[&["help"], &words[..]].concat()).ok().out);
        assert!(help.out.contains(&format!("Usage: diaphane {command}")), "{}", help.out);
        for flag in ["--json", "--cache-dir <DIR>", "--no-cache", "--adapter <NAME>", "--set <PATH=RON>"] {
            assert!(help.out.contains(flag), "{command} {flag}");
        }
        let lines: Vec<&str> = help.out.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let entry = line.trim_start();
            if line.starts_with("  ") && (entry.starts_with('-') || entry.starts_with('<')) {
                let told = entry.contains("  ") || lines.get(i + 1).is_some_and(|next| next.starts_with("      "));
                assert!(told, "{command}: {line}");
            }
        }
    }
}

#[test]
fn every_command_speaks_json_and_nothing_else_on_stdout() {
    let desk = Desk::new();
    let ok: [&[&str]; 13] = [
        &[],
        &["--help"],
        &["--version"],
        &["new", "a"],
        &["check", "scene.ron", "stone.ron"],
        &["check", "scene.ron", "--defaults"],
        &["explain", "scene.ron"],
        &["bake", "scene.ron"],
        &["media", "list"],
        &["media", "show", "marble", "--scene", "scene.ron"],
        &["techniques", "Opaque"],
        &["cache", "stat"],
        &["cache", "clear"],
    ];
    for words in ok {
        let ran = desk.run(&[words, &["--json"]].concat()).ok();
        assert!(ran.json().is_object() && ran.err.is_empty(), "{ran:#?}");
    }
    let wrong: [(&[&str], i32); 9] = [
        (&["frobnicate"], 2),
        (&["render"], 2),
        (&["bench", "scene.ron"], 2),
        (&["render", "scene.ron", "-o", "x.jpg"], 2),
        (&["check", "scene.ron", "nothing.ron"], 1),
        (&["explain", "scene.ron", "--set", "mm_per_unit=NaN"], 2),
        (&["techniques", "Opake"], 2),
        (&["media", "show", "marbel"], 2),
        (&["cache", "stat", "--cache-dir", "scene.ron"], 5),
    ];
    for (words, status) in wrong {
        let (plain, json) = (desk.run(words).fails(status, &[]), desk.run(&[words, &["--json"]].concat()));
        assert_eq!(json.status, status);
        assert_eq!(json.err.lines().next(), plain.err.lines().next(), "stderr is the same");
        let problems = json.json();
        let problem = &problems["problems"][0];
        assert!(problem["what"].as_str().is_some_and(|what| !what.is_empty()), "{json:#?}");
        assert!(problem["hint"].as_str().is_some_and(|hint| !hint.is_empty()), "{json:#?}");
        assert_eq!(problem["severity"], "error");
    }
    let ran = desk.run_with(&NO_ADAPTER, &["doctor", "--json"]);
    assert_eq!((ran.status, ran.json()["problems"][0]["what"].as_str()), (3, Some("there is no graphics adapter")));
}

#[test]
fn a_place_in_a_file_reaches_programs() {
    let desk = Desk::new();
    desk.write("bad.ron", "Scene(version: 1,\n  mm_per_unit: -1)");
    let said = desk.run(&["check", "bad.ron", "--json"]).json();
    let problem = &said["problems"][0];
    let expected = serde_json::json!({ "file": "bad.ron", "line": 2, "column": 16, "path": "mm_per_unit" });
    for (name, value) in expected.as_object().unwrap() {
        assert_eq!(&problem[name], value);
    }
}

#[test]
fn words_that_are_misspelt_or_missing_are_told() {
    let desk = Desk::new();
    desk.run(&["rendr", "scene.ron"]).fails(2, &["'rendr'", "'render'"]);
    desk.run(&["media"]).fails(2, &["  list  ", "  show  ", "  profile  "]);
    desk.run(&["render", "scene.ron"]).fails(2, &["--output <FILE>"]);
    desk.run(&["check"]).fails(2, &["<FILE>"]);
    desk.run(&["explain", "scene.ron", "--part", "shiny"]).fails(2, &["shiny", "glossy"]);
}

#[test]
fn techniques_are_listed_and_explained() {
    let desk = Desk::new();
    let list = desk.run(&["techniques"]).ok();
    for technique in diaphane::techniques::REGISTRY {
        assert!(list.out.contains(&format!("{}  ", technique.name)), "{}", list.out);
        let manual = desk.run(&["techniques", technique.name]).ok();
        assert_eq!(manual.out, desk.run(&["techniques", &technique.name.to_lowercase()]).ok().out);
        assert!(manual.out.contains("In a scene:") && !manual.out.contains("```"), "{}", manual.out);
    }
    desk.run(&["techniques", "FilteredNormals"]).says(&["[Patro2007] R. Patro"]);
    desk.run(&["techniques", "FiltredNormals"]).fails(2, &["did you mean FilteredNormals?"]);
    let later = desk.run(&["techniques", "PrecomputedTransfer"]);
    if later.status != 0 {
        later.fails(2, &["PrecomputedTransfer is not in this version", "there is Opaque"]);
    }
}

#[test]
fn media_are_listed_and_every_quantity_of_one_is_told() {
    let desk = Desk::new();
    let list = desk.run(&["media", "list"]).ok().says(&["skin1", "0.74", "Jensen2001"]);
    assert!(list.out.lines().count() > 12);
    let marble =
        desk.run(&["media", "show", "marble"]).ok().says(&["sigma_s' [1/mm]", "2.19000", "mean free path [mm]"]);
    // The same medium as a file, but for its name in the first line.
    let stone = desk.run(&["media", "show", "stone.ron"]).ok();
    assert_eq!(marble.out.split_once('\n').unwrap().1, stone.out.split_once('\n').unwrap().1);
    let within = desk.run(&["media", "show", "marble", "--scene", "scene.ron"]).ok();
    within.says(&["[scene units]", "[pixels]", "share of `ball`"]);
    let facts = desk.run(&["media", "show", "marble", "--scene", "scene.ron", "--json"]).ok().json();
    let distance = facts["scattering distance 1/sigma_tr [mm]"][0].as_f64().unwrap();
    assert!((facts["scene"]["units"][0].as_f64().unwrap() - distance / 10.0).abs() < 1e-12);
    // Every length and coefficient, not the scattering distance alone.
    let path = &facts["scene"]["quantities"]["mean free path"];
    assert!((path["units"][0].as_f64().unwrap() - 1.0 / 21.921).abs() < 1e-12);
    let share = path["share_of_object"]["ball"][0].as_f64().unwrap() / path["pixels"][0].as_f64().unwrap();
    let other = &facts["scene"];
    let same = other["share_of_object"]["ball"][0].as_f64().unwrap() / other["pixels"][0].as_f64().unwrap();
    assert!((share / same - 1.0).abs() < 1e-12);
    assert!((facts["scene"]["quantities"]["sigma_a"]["per_unit"][0].as_f64().unwrap() - 0.021).abs() < 1e-12);
    desk.run(&["media", "show", "fish organs"]).ok().says(&["phase Schlick", "k of the phase function"]);
    desk.run(&["media", "show", "marbel"]).fails(2, &["`marbel`", "did you mean `marble`?"]);
    desk.run(&["media", "show", "scene.ron"]).fails(1, &["scene.ron:1:1", "Material( )"]);
    desk.run(&["media", "show", "marble", "--scene", "stone.ron"]).fails(1, &["stone.ron:1:1", "Scene( )"]);
}

#[test]
fn a_profile_is_told_for_coefficients_for_a_medium_and_for_a_file() {
    let desk = Desk::new();
    let coefficients = ["media", "profile", "--sigma-a", "0.1", "--sigma-s", "0.9", "--ior", "1.33"];
    let radii = ["--radius", "0.1,1,10"];
    let run = |more: &[&str]| desk.run(&[&coefficients[..], more, &radii].concat());
    let number = |value: &Value| value.as_f64().unwrap();
    for (model, golden, albedo) in [
        ("PhotonBeamDiffusion", [0.1055553 + 0.2612586, 0.01266397 + 0.001103233, 7.354803e-6], 0.2958),
        ("Dipole", [0.06395592, 0.02149017, 5.998901e-6], 0.294128),
        ("BetterDipole", [0.03277093, 0.01406736, 7.863486e-6], 0.233951),
    ] {
        let facts = run(&["--g", "0", "--model", model, "--json"]).ok().json();
        assert_eq!(facts["radius_mm"], serde_json::json!([0.1, 1.0, 10.0]));
        for (value, golden) in facts["r_d"].as_array().unwrap().iter().zip(golden) {
            assert!((number(value) / golden - 1.0).abs() < 5e-7, "{model}: {value} {golden}");
        }
        assert!((number(&facts["albedo"]) - albedo).abs() < 2e-6, "{facts}");
    }
    run(&[]).ok().says(&["ior 1.33, PhotonBeamDiffusion", "R_d [1/mm²]", "7.3548029841e-6", "albedo"]);
    assert_eq!(run(&["--g", "-0.5"]).status, 0);
    // At 0 some are infinite, which JSON does not know.
    let facts = desk.run(&[&coefficients[..], &["--radius", "0", "--json"]].concat()).ok().json();
    assert!(facts["r_d"][0].is_null());

    // A medium has three channels; a file its own model and index.
    let marble = desk.run(&["media", "profile", "marble", "--radius", "1", "--json"]).ok().json();
    let red = desk.run(&[
        "media",
        "profile",
        "--sigma-a",
        "0.0021",
        "--sigma-s",
        "2.19",
        "--ior",
        "1.5",
        "--radius",
        "1",
        "--json",
    ]);
    assert_eq!(marble["r_d"][0][0], red.ok().json()["r_d"][0]);
    desk.write("wax.ron", "Material(version: 1, medium: Preset(\"marble\"), surface: (ior: 1.2), profile: Dipole)");
    let wax = desk.run(&["media", "profile", "wax.ron", "--radius", "1,2", "--json"]).ok().json();
    assert_eq!((wax["model"].as_str(), wax["ior"].as_f64()), (Some("Dipole"), Some(1.2)));
    assert_eq!(wax["r_d"][1].as_array().unwrap().len(), 3);

    for (words, said) in [
        (&["--model", "Dipol"][..], "did you mean Dipole?"),
        (&["--model", "7"], "there is PhotonBeamDiffusion"),
        (&["--g", "1"], "between -1 and 1"),
        (&["--ior", "0.9"], "from 1"),
    ] {
        let ran = desk.run(&[&coefficients[..6], words, &radii].concat()).fails(2, &[said]);
        assert!(ran.out.is_empty());
    }
    desk.run(&["media", "profile", "--sigma-a", "0.1", "--radius", "1"]).fails(2, &["--sigma-s <S>"]);
    desk.run(&["media", "profile", "--sigma-a", "nan", "--sigma-s", "1", "--radius", "1"]).fails(2, &["0 or more"]);
    desk.run(&["media", "profile", "marble", "--sigma-a", "1", "--radius", "1"]).fails(2, &["cannot be used with"]);
    desk.run(&["media", "profile", "marbel", "--radius", "1"]).fails(2, &["did you mean `marble`?"]);
}

#[test]
fn explain_is_a_plan_that_needs_no_adapter() {
    let desk = Desk::new();
    let explain = |more: &[&str]| desk.run_with(&NO_ADAPTER, &[&["explain", "scene.ron"], more].concat()).ok();
    let text = explain(&[]);
    text.says(&[
        "scene.ron: 1 object and 1 light, 24 x 16 pixels",
        "Opaque()",
        "The shapes",
        "The picture",
        "Left out",
    ]);
    assert!(explain(&["--technique", "FilteredNormals()"]).out.lines().all(|line| line.chars().count() <= 120));

    let plan = explain(&["--json"]).json();
    let names = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&plan), ["skipped", "steps"]);
    let steps = plan["steps"].as_array().unwrap();
    let mut seen = Vec::new();
    for step in steps {
        assert_eq!(names(step), ["about", "inputs", "key", "name", "state"]);
        assert!(["run", "memory", "disk"].contains(&step["state"].as_str().unwrap()));
        assert!(step["inputs"].as_array().unwrap().iter().all(|input| seen.contains(input)), "inputs come first");
        seen.push(step["key"].clone());
    }
    assert!(steps.len() > 5 && steps.iter().all(|step| step["state"] == "run"));
    // What a scene does not show is skipped, with the reason.
    let skipped = explain(&["--json", "--set", "objects.ball.visible=false"]).json()["skipped"].clone();
    assert_eq!(names(&skipped[0]), ["what", "why"]);
    assert!(skipped[0]["what"].as_str().unwrap().contains("`ball`") && skipped[0]["why"] == "visible: false");

    // After a bake, what was baked is on disk, and what only bakes need does not run either.
    desk.run_with(&NO_ADAPTER, &["bake", "scene.ron"]).ok();
    let baked = explain(&["--json"]).json();
    let on_disk = |plan: &Value| plan["steps"].as_array().unwrap().iter().filter(|s| s["state"] == "disk").count();
    assert!(on_disk(&baked) > 0 && on_disk(&plan) == 0);
    assert_eq!(on_disk(&explain(&["--json", "--no-cache"]).json()), 0);
}
