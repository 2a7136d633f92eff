//! The window, on a desktop that nobody sees: files change under it, it is pulled about, its device is lost, and it goes on.
//!
//! Nothing here depends on how long something takes: a deadline only passes when nothing happens at all.

#![cfg(all(feature = "preview", target_os = "linux"))]

mod desktop;
mod hands;
mod motion;
mod traced;

use desktop::{scene, window};
use std::path::Path;
use std::process::Command;
use std::time::Duration;

#[test]
fn edits_show_broken_ones_are_told_and_mended_ones_forgotten() {
    let Some(mut window) = window(&scene("3"), &[]) else { return };
    window.event("ready");
    let first = window.picture();
    assert_eq!((&first["width"], &first["height"]), (&160.into(), &120.into()));

    window.write("work/scene.ron", &scene("2"));
    let second = window.picture();
    assert_ne!(second["picture"], first["picture"]);
    assert_eq!(second["bakes"]["run"], 0, "light is no part of a shape");

    window.write("work/scene.ron", &scene("-2"));
    let problem = &window.event("problem")["problems"][0];
    assert_eq!((problem["line"].as_u64(), problem["severity"].as_str()), (Some(6), Some("error")), "{problem}");
    assert!(problem["file"].as_str().unwrap().ends_with("scene.ron") && problem["hint"].is_string(), "{problem}");
    // The last good scene goes on.
    window.tell("orbit 30 10");
    assert_ne!(window.picture()["picture"], second["picture"]);
    window.tell("camera close");
    window.picture();
    window.write("work/scene.ron", &scene("2"));
    window.event("mended");

    // The material is a file too, and may vanish for a while; so may the folder.
    std::fs::rename(window.path("work/stone.ron"), window.path("stone.ron")).unwrap();
    assert!(window.event("problem").to_string().contains("stone.ron"));
    std::fs::rename(window.path("stone.ron"), window.path("work/stone.ron")).unwrap();
    window.event("mended");
    std::fs::rename(window.path("work"), window.path("away")).unwrap();
    window.event("problem");
    std::fs::rename(window.path("away"), window.path("work")).unwrap();
    window.event("mended");
    window.write("work/scene.ron", &scene("1.5"));
    window.picture();
    assert!(window.close().success());
}

#[test]
fn of_many_edits_the_last_one_wins() {
    let Some(mut window) = window(&scene("7"), &[]) else { return };
    let wanted = window.picture()["picture"].clone();
    window.write("work/scene.ron", &scene("1"));
    assert_ne!(window.picture()["picture"], wanted);
    for i in 0..200 {
        window.write("work/scene.ron", &scene(&format!("1.{i}")));
        std::thread::sleep(Duration::from_millis(10));
    }
    window.write("work/scene.ron", &scene("7"));
    window.picture_that_is(&wanted);
    // Nothing older comes after it, and nothing is drawn when nothing happens.
    let frames = window.status()["frames"].clone();
    std::thread::sleep(Duration::from_millis(1500));
    let later = window.status();
    assert!(later["problems"].as_array().is_some_and(Vec::is_empty), "{later}");
    assert!(later["frames"].as_u64() <= frames.as_u64().map(|frames| frames + 5), "an idle window draws: {later}");
    let last = window.seen.iter().rfind(|event| event["event"] == "drawn").unwrap();
    assert_eq!(last["picture"], wanted);
    assert!(window.close().success());
}

#[test]
fn hands_move_the_camera_and_pictures_are_written_under_free_names() {
    let Some(mut window) = window(&scene("3"), &[]) else { return };
    let first = window.picture();
    window.tell("orbit 40 0");
    let turned = window.picture();
    assert_ne!(turned["picture"], first["picture"]);
    assert_eq!(turned["bakes"]["run"], 0);
    window.tell("orbit -40 0");
    window.picture();
    for words in ["pan 5 5", "zoom 2", "exposure 1", "camera close", "frame ball", "technique FilteredNormals()"] {
        window.tell(words);
        window.picture();
    }
    window.tell("technique Sorcery()");
    assert!(window.event("problem").to_string().contains("Sorcery"));
    window.tell("technique Opaque()");
    window.event("mended");
    window.tell("camera nowhere");
    window.event("refused");

    window.tell("screenshot");
    let one = window.event("screenshot")["path"].as_str().unwrap().to_string();
    let kept = std::fs::read(window.path(&one)).unwrap();
    window.tell("screenshot");
    let two = window.event("screenshot")["path"].as_str().unwrap().to_string();
    assert_ne!(one, two);
    assert!(window.path(&two).is_file() && std::fs::read(window.path(&one)).unwrap() == kept);
    window.tell("capture all.png");
    window.event("captured");
    let all = image::open(window.path("all.png")).unwrap().to_rgb8();
    assert_eq!(all.dimensions(), (160, 120));
    // The window shows the levels that the file stores, but for a note at its top.
    let file = image::load_from_memory(&kept).unwrap().to_rgb8();
    let far = |y: u32| (0..160).filter(|x| (0..3).any(|c| all[(*x, y)][c].abs_diff(file[(*x, y)][c]) > 1)).count();
    let (bottom, total) = ((80..120).map(far).sum::<usize>(), (0..120).map(far).sum::<usize>());
    assert!(bottom == 0 && total < 160 * 60, "{bottom} and {total} pixels differ");
    assert!(window.close().success());
}

#[test]
fn a_window_is_resized_wildly_hidden_and_minimised() {
    let Some(mut window) = window(&scene("3"), &[]) else { return };
    let first = window.picture();
    for round in 0..3 {
        for size in ["1x1", "300x20", "0x0", "700x500", "17x391", "0x0", "0x0", "2x700", "160x120"] {
            window.tell(&format!("resize {size}"));
        }
        window.tell("hide");
        window.tell("show");
        if round == 1 {
            window.status();
        }
    }
    window.tell("resize 0x0");
    assert!(window.status()["size"].is_null());
    window.tell("resize 90x60");
    window.until("small picture", |event| event["width"] == 90 && event["height"] == 60);
    window.tell("resize 160x120");
    window.picture_that_is(&first["picture"]);
    assert!(window.close().success());
}

#[test]
fn a_lost_device_is_opened_again() {
    let Some(mut window) = window(&scene("3"), &[]) else { return };
    let first = window.picture();
    for _ in 0..2 {
        window.tell("lose-device");
        window.event("rebuilt");
        assert_eq!(window.picture()["picture"], first["picture"]);
    }
    assert!(window.close().success());
}

/// Two spheres of so many subdivisions, whose normals are to be filtered.
fn spheres(subdivisions: u32) -> String {
    let ball = |name: &str, x: i32| {
        format!(
            r#"(name: "{name}", mesh: Sphere(radius: 1, subdivisions: {subdivisions}), material: "stone.ron",
                transform: (translate: ({x}, 0, 0)))"#
        )
    };
    let one = r#"(name: "ball", mesh: Sphere(radius: 1, subdivisions: 2), material: "stone.ron")"#;
    scene("3").replace(one, &format!("{}, {}", ball("left", -1), ball("right", 1)))
}

#[test]
fn two_million_triangles_are_waited_for_with_open_eyes() {
    let Some(mut window) = window(&spheres(8), &[]) else { return };
    window.event("baking");
    window.tell("status");
    window.picture();
    assert!(window.seen.iter().any(|event| event["event"] == "status") || window.event("status").is_object());
    window.tell("orbit 20 5");
    assert_eq!(window.picture()["bakes"]["run"], 0);
    assert!(window.close().success());
}

#[test]
fn closing_does_not_wait_for_a_bake_and_an_edit_supersedes_it() {
    let slow = spheres(8).replace("Opaque()", "FilteredNormals()");
    let Some(mut window) = window(&scene("3"), &[]) else { return };
    let first = window.picture();
    window.write("work/scene.ron", &slow);
    window.event("baking");
    window.write("work/scene.ron", &scene("2"));
    assert_ne!(window.picture()["picture"], first["picture"]);
    window.write("work/scene.ron", &slow);
    window.event("baking");
    assert!(window.close().success());
}

#[test]
fn a_broken_shader_leaves_the_last_good_one_in_use() {
    let shaders = tempfile::tempdir().unwrap();
    fn copy(from: &Path, to: &Path) {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
            match entry.path() {
                path if path.is_dir() => copy(&path, &to.join(entry.file_name())),
                path => drop(std::fs::copy(path, to.join(entry.file_name())).unwrap()),
            }
        }
    }
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders"), shaders.path());
    let Some(mut window) = window(&scene("3"), &[("DIAPHANE_SHADERS", shaders.path())]) else { return };
    let first = window.picture();
    let file = shaders.path().join("frame/compose.wgsl");
    let good = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, good.replace("fn fragment", "fn fragment oops")).unwrap();
    let problem = &window.event("problem")["problems"][0];
    assert!(problem["file"].as_str().unwrap().ends_with("compose.wgsl") && problem["line"].is_u64(), "{problem}");
    window.tell("orbit 30 0");
    assert_ne!(window.picture()["picture"], first["picture"]);
    std::fs::write(&file, good).unwrap();
    window.event("mended");
    assert!(window.close().success());
}

#[test]
fn without_a_desktop_or_a_scene_it_ends_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.ron"), scene("3")).unwrap();
    for (file, status, words) in
        [("scene.ron", 3, "needs a desktop"), ("no.ron", 1, "no.ron: error: it cannot be read")]
    {
        let output = Command::new(assert_cmd::cargo::cargo_bin!("diaphane"))
            .args(["preview", file])
            .current_dir(folder.path())
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{said}");
        assert!(said.contains(words) && said.contains("hint: "), "{said}");
    }
}
