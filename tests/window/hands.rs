//! A mouse and keys as the system has them, not the words that stand for them.

use super::desktop::{Window, scene, window};
use serde_json::Value;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ConnectionExt as _, InputFocus, KEY_PRESS_EVENT,
    KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

const LEFT: u8 = 1;
const MIDDLE: u8 = 2;
const WHEEL_UP: u8 = 4;
const SHIFT: u32 = 0xffe1;

/// What a hand holds.
struct Hands {
    desktop: RustConnection,
    root: u32,
    /// Where the window begins on the desktop.
    corner: (i16, i16),
}

impl Hands {
    fn on(window: &Window) -> Hands {
        let (desktop, screen) = RustConnection::connect(Some(&window.display)).unwrap();
        let root = desktop.setup().roots[screen].root;
        let title = |id: &u32| {
            let name = desktop.get_property(false, *id, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 64).unwrap();
            String::from_utf8_lossy(&name.reply().unwrap().value).into_owned()
        };
        let all = desktop.query_tree(root).unwrap().reply().unwrap().children;
        let id = all.into_iter().find(|id| title(id).ends_with("diaphane")).unwrap();
        // Nobody else on this desktop says who hears the keys.
        desktop.set_input_focus(InputFocus::PARENT, id, x11rb::CURRENT_TIME).unwrap().check().unwrap();
        let place = desktop.get_geometry(id).unwrap().reply().unwrap();
        Hands { root, corner: (place.x, place.y), desktop }
    }

    fn does(&self, kind: u8, detail: u8, x: i16, y: i16) {
        let time = x11rb::CURRENT_TIME;
        self.desktop.xtest_fake_input(kind, detail, time, self.root, x, y, 0).unwrap().check().unwrap();
    }

    /// To a place in the window, pixels.
    fn points(&self, x: i16, y: i16) {
        self.does(MOTION_NOTIFY_EVENT, 0, self.corner.0 + x, self.corner.1 + y);
    }

    fn presses(&self, button: u8) {
        self.does(BUTTON_PRESS_EVENT, button, 0, 0);
    }

    fn releases(&self, button: u8) {
        self.does(BUTTON_RELEASE_EVENT, button, 0, 0);
    }

    fn key(&self, kind: u8, symbol: u32) {
        let setup = self.desktop.setup();
        let (first, count) = (setup.min_keycode, setup.max_keycode - setup.min_keycode + 1);
        let map = self.desktop.get_keyboard_mapping(first, count).unwrap().reply().unwrap();
        let of_keys = map.keysyms.chunks(map.keysyms_per_keycode.into());
        let key = of_keys.zip(first..).find(|(symbols, _)| symbols.contains(&symbol)).unwrap().1;
        self.does(kind, key, 0, 0);
    }

    fn types(&self, letter: char) {
        self.key(KEY_PRESS_EVENT, letter.into());
        self.key(KEY_RELEASE_EVENT, letter.into());
    }
}

fn vector(status: &Value, name: &str) -> glam::DVec3 {
    glam::DVec3::from_slice(&[0, 1, 2].map(|i| status[name][i].as_f64().unwrap()))
}

fn eye(status: &Value) -> glam::DVec3 {
    vector(status, "eye")
}

fn target(status: &Value) -> glam::DVec3 {
    vector(status, "target")
}

fn distance(status: &Value) -> f64 {
    eye(status).distance(target(status))
}

#[test]
fn drags_wheels_clicks_and_keys_do_what_the_panel_says() {
    let Some(mut window) = window(&scene("3"), &[]) else { return };
    let first = window.picture();
    let hands = Hands::on(&window);
    let start = window.status();

    // A drag turns the eye about the target.
    let dragged = |window: &mut Window, button: u8, what: &str, holds: &dyn Fn(&Value) -> bool| {
        let mut x = 60;
        hands.points(x, 60);
        hands.presses(button);
        let further = || {
            x = if x < 120 { x + 5 } else { 60 };
            hands.points(x, 60);
        };
        let status = window.until_status(what, further, holds);
        hands.releases(button);
        status
    };
    let turned = dragged(&mut window, LEFT, "turn", &|status| eye(status) != eye(&start));
    assert!(target(&turned) == target(&start) && (distance(&turned) - distance(&start)).abs() < 1e-9, "{turned}");
    window.shows("other picture", |event| event["whole"] == true && event["picture"] != first["picture"]);
    // `R` goes back.
    window.until_status("way back", || hands.types('r'), |status| eye(status) == eye(&start));
    window.picture_that_is(&first["picture"]);

    // With shift, or the middle button, eye and target move alike.
    hands.key(KEY_PRESS_EVENT, SHIFT);
    let shifted = dragged(&mut window, LEFT, "shift", &|status| target(status) != target(&start));
    hands.key(KEY_RELEASE_EVENT, SHIFT);
    assert!((eye(&shifted) - target(&shifted)).distance(eye(&start) - target(&start)) < 1e-9, "{shifted}");
    window.until_status("way back", || hands.types('r'), |status| eye(status) == eye(&start));
    dragged(&mut window, MIDDLE, "shift", &|status| target(status) != target(&start));
    window.until_status("way back", || hands.types('r'), |status| eye(status) == eye(&start));

    // The wheel comes nearer.
    hands.points(80, 60);
    hands.presses(WHEEL_UP);
    hands.releases(WHEEL_UP);
    let near = window.until_status("nearer", || (), |status| distance(status) < distance(&start));
    assert!((eye(&near) - target(&near)).angle_between(eye(&start) - target(&start)) < 1e-6, "{near}");
    window.until_status("way back", || hands.types('r'), |status| eye(status) == eye(&start));

    // A click chooses what is there, one beside it nothing; `F` looks at what is chosen, or at all.
    let click = |x: i16, y: i16| {
        hands.points(x, y);
        hands.presses(LEFT);
        hands.releases(LEFT);
    };
    click(80, 60);
    window.until_status("choice", || (), |status| status["chosen"] == "ball");
    let before = window.status();
    window.until_status("look", || hands.types('f'), |status| distance(status) != distance(&before));
    click(3, 3);
    window.until_status("choice", || (), |status| status["chosen"].is_null());

    // `P` writes the picture, `H` hides the panel, the space bar starts and stops time.
    hands.types('p');
    let file = window.event("screenshot")["path"].as_str().unwrap().to_string();
    assert!(window.path(&file).is_file());
    hands.types('h');
    window.until_status("panel that is gone", || (), |status| status["panel"] == false);
    hands.types('h');
    window.until_status("panel", || (), |status| status["panel"] == true);
    hands.types(' ');
    window.until_status("time", || (), |status| status["playing"] == true);
    hands.types(' ');
    window.until_status("standstill", || (), |status| status["playing"] == false);
    assert!(window.close().success());
}
