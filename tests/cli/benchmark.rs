//! `bench`: what it writes, that it goes on where it was, and that it notices what got worse.

use crate::{Desk, NO_ADAPTER};

const BENCH: &str = "Bench(version: 1, techniques: [Opaque(), FilteredNormals()], size: (24, 16), repetitions: 1,
    max_error: 0.9, max_spp: 4)
";
const HEADER: &str = "scene,technique,settings,size,measure,unit,repeat,value";

fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("scene.bench.ron", BENCH);
    desk
}

fn text(desk: &Desk, name: &str) -> String {
    String::from_utf8(desk.read(name)).unwrap()
}

#[test]
fn everything_is_written_and_nothing_is_measured_twice() {
    let desk = desk();
    let run = |more: &[&str]| desk.run(&[&["bench", "scene.ron", "-o", "out", "--json"], more].concat()).ok().json();
    let first = run(&[]);
    let csv = text(&desk, "out/samples.csv");
    let rows: Vec<&str> = csv.lines().skip(1).collect();
    assert_eq!((csv.lines().next(), first["new_rows"].as_u64()), (Some(HEADER), Some(rows.len() as u64)));
    for technique in ["Opaque", "FilteredNormals"] {
        let count = |measure: &str| {
            let start = format!("scene,{technique},,24x16,{measure}");
            rows.iter().filter(|row| row.starts_with(&start)).count()
        };
        for measure in ["bake,ms,1,", "frame,ms,1,", "pass:technique.local,ms,1,"] {
            assert_eq!(count(measure), 1, "{measure}");
        }
        for measure in ["relmse", "relmse_se", "dssim", "flip_mean", "flip_p99", "bias"] {
            for truth in ["volume", "bssrdf"] {
                assert_eq!(count(&format!("{measure}@{truth},1,1,")), 1, "{measure}");
            }
        }
    }
    let (svg, html) = (text(&desk, "out/scene.svg"), text(&desk, "out/index.html"));
    assert!(svg.contains("FilteredNormals()") && html.contains(&svg) && html.contains("data:image/png;base64,"));
    let machine: serde_json::Value = serde_json::from_str(&text(&desk, "out/machine.json")).unwrap();
    for field in ["adapter", "driver", "cpu", "commit", "date"] {
        assert!(machine[field].as_str().is_some_and(|said| !said.is_empty()), "{field}");
    }
    let is_software = machine["is_software"].as_bool().unwrap();
    assert_eq!([&svg, &html].map(|text| text.contains("software adapter")), [is_software; 2]);
    assert!(first["scenes"][0]["techniques"][0]["errors"]["volume"]["relmse"].is_number(), "{first:#}");

    // Again, by the name of the file beside it: nothing is new.
    let again = desk.run(&["bench", "scene.bench.ron", "scene.ron", "-o", "out", "--json"]).ok().json();
    assert_eq!((again["new_rows"].as_u64(), text(&desk, "out/samples.csv")), (Some(0), csv.clone()));
    // One more of each frame and edit, and no more than that.
    let more = run(&["--repetitions", "2"]);
    let is_drawn = |row: &&&str| [",frame,", ",pass:", ",edit:"].iter().any(|measure| row.contains(measure));
    let drawn = rows.iter().filter(is_drawn).count();
    assert_eq!(more["new_rows"].as_u64(), Some(drawn as u64));
    // What an interruption cuts off is measured again.
    let all = text(&desk, "out/samples.csv");
    let cut: Vec<&str> = all.lines().filter(|row| !row.contains("FilteredNormals,,24x16,bake")).collect();
    desk.write("out/samples.csv", cut.join("\n") + "\n");
    assert_eq!(run(&["--repetitions", "2"])["new_rows"], 1);
    // Another light: the rows are those of another scene.
    let other = run(&["--set", "lights.sun.irradiance=2"]);
    assert_eq!(other["new_rows"].as_u64(), Some(rows.len() as u64));
    assert_eq!(text(&desk, "out/samples.csv").lines().count(), rows.len() + 1);
}

#[test]
fn what_got_worse_since_an_earlier_run_fails() {
    let desk = desk();
    let bench = ["bench", "scene.ron", "-o", "out", "--technique", "Opaque()"];
    desk.run(&bench).ok();
    let earlier = |measure: &str, value: &str| {
        let change = |row: &str| match row.contains(&format!(",{measure},")) {
            true => format!("{}{value}\n", &row[..row.rfind(',').unwrap() + 1]),
            false => format!("{row}\n"),
        };
        desk.write("old/samples.csv", text(&desk, "out/samples.csv").lines().map(change).collect::<String>());
        desk.write("old/machine.json", desk.read("out/machine.json"));
        desk.run(&[&bench[..], &["--against", "old"]].concat())
    };
    let worse = |measure: &str, value: &str, says: &str| {
        let ran = earlier(measure, value);
        assert!(ran.status == 4 && ran.err.contains(says) && ran.out.contains("samples.csv"), "{ran:#?}");
    };
    earlier("nothing", "0").ok();
    worse("frame", "1e-9", "scene, Opaque(), 24x16: frame takes");
    worse("pass:frame.gbuffer", "1e-9", "pass:frame.gbuffer takes");
    worse("dssim@volume", "0", "and was 0");
    earlier("frame", "1e-9");
    let machine = text(&desk, "out/machine.json").replace("\"threads\": ", "\"threads\": 9");
    desk.write("old/machine.json", machine);
    let ran = desk.run(&[&bench[..], &["--against", "old"]].concat()).ok();
    assert!(ran.err.contains("its times say nothing"), "{ran:#?}");
    desk.run(&["bench", "scene.ron", "-o", "old"]).fails(2, &["another machine measured"]);
    desk.run(&[&bench[..], &["--against", "nowhere"]].concat()).fails(2, &["nowhere holds no samples.csv"]);
}

#[test]
fn mistakes_are_told_before_anything_is_measured() {
    let desk = desk();
    let fails = |status: i32, says: &[&str]| {
        desk.run(&["bench", "scene.ron", "-o", "out"]).fails(status, says);
        assert!(!desk.path("out").exists());
    };
    desk.write("scene.bench.ron", "Bench(version: 1,\n  sizes: (3, 3))");
    fails(1, &["scene.bench.ron:2:3: error", "there is no field `sizes`", "did you mean `size`"]);
    desk.write("scene.bench.ron", "Bench(version: 1,\n  techniques: [Opaqe()])");
    fails(1, &["scene.bench.ron:2:16: error", "there is no technique `Opaqe`", "Opaque"]);
    desk.run(&["check", "scene.bench.ron"]).fails(1, &["scene.bench.ron:2:16: error"]);
    desk.write("scene.bench.ron", "Bench(version: 1,\n  techniques: [Reference()])");
    fails(1, &["scene.bench.ron:2:16: error", "the reference is the truth"]);
    desk.write("scene.bench.ron", BENCH);
    desk.run(&["check", "scene.bench.ron"]).ok();
    desk.run(&["check", "--defaults", "scene.bench.ron"]).ok();
    desk.run(&["bench", "scene.ron", "-o", "out", "--technique", "Opaqe"]).fails(2, &["--technique:1:1"]);
    desk.run(&["bench", "scene.ron", "-o", "out", "--max-error", "0"]).fails(2, &["--max-error"]);
    desk.run_with(&NO_ADAPTER, &["bench", "scene.ron", "-o", "out"]).fails(3, &["no graphics adapter"]);
    // A material that a technique cannot do leaves it out, as long as another is left.
    desk.write("stone.ron", "Material(version: 1, medium: Preset(\"marble\"), filter: Box(wavelength: 1))");
    let both = ["--technique", "Opaque()", "--technique", "FilteredNormals(engine: Krylov)"];
    let json = desk.run(&[&["bench", "scene.ron", "-o", "out", "--json"], both.as_slice()].concat());
    assert!(json.out.contains("FilteredNormals(engine: Krylov) is left out"), "{json:#?}");
    let only = ["bench", "scene.ron", "-o", "none", "--technique", "FilteredNormals(engine: Krylov)"];
    desk.run(&only).fails(1, &["none of 1 techniques can draw it", "left out"]);
}
