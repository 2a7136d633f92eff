//! A scene that moves.

use super::desktop::window;

const SCENE: &str = r#"Scene(
    version: 1,
    mm_per_unit: 10,
    camera: (eye: (2, 2, 4)),
    lights: [Directional(name: "sun", direction: (-1, 0, -1), irradiance: 3)],
    objects: [
        (name: "tower", mesh: Slab(size: (1, 2, 0.5), segments: (8, 8)), material: "stone.ron",
         deform: [Twist(axis: (0, 1, 0), deg_per_unit: 40, speed_hz: 0.3)]),
    ],
    view: (technique: FilteredNormals(), antialias: 1),
)
"#;

#[test]
fn time_goes_by_stands_still_and_can_be_set_and_bakes_follow_the_shape() {
    let Some(mut window) = window(SCENE, &[]) else { return };
    let start = window.picture();
    window.tell("time 0.5");
    let later = window.until("picture", |event| event["event"] == "drawn" && event["current"] == true);
    assert_ne!(later["picture"], start["picture"]);
    assert!(later["bakes"]["run"].as_u64() > Some(0), "its normals are filtered anew: {later}");
    assert_eq!(window.status()["time_s"], 0.5);
    window.tell("time 0");
    let back = window.until("picture", |event| event["picture"] == start["picture"]);
    assert_eq!(back["bakes"]["run"], 0, "{back}");

    window.tell("play");
    let mut shown = vec![start["picture"].clone()];
    while shown.len() < 4 {
        let picture = window.until("picture", |event| event["event"] == "drawn" && event["current"] == true);
        if !shown.contains(&picture["picture"]) {
            shown.push(picture["picture"].clone());
        }
    }
    window.tell("pause");
    let stopped = window.status();
    assert!(stopped["playing"] == false && stopped["time_s"].as_f64() > Some(0.0), "{stopped}");
    assert_eq!(window.status()["time_s"], stopped["time_s"]);
    assert!(window.close().success());
}
