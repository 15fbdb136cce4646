//! The page in headless Chromium: what is moved moves, by pointer and by keyboard, in silence.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use pathspace_benches::report;
use serde_json::{Value, json};

use crate::chromium::Chromium;
use crate::page::folder;
use crate::sample::sample;

/// A page of two scenes in a browser of its own.
struct Page {
    chromium: Chromium,
    /// One browser at a time is enough for a machine.
    _turn: MutexGuard<'static, ()>,
}

static TURN: Mutex<()> = Mutex::new(());

impl Page {
    /// `None`, with the reason on stderr, where there is no Chromium.
    fn open(name: &str, width: u32) -> Option<Page> {
        // A test that failed leaves nothing behind that could spoil the next.
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = folder(name);
        let Some(chromium) = Chromium::launch(&folder.join("profile")) else {
            eprintln!("skipped: no Chromium on the path; its file may be named by CHROME");
            return None;
        };
        let results = sample(&folder, &["room", "cellar"], &["pt", "bdpt", "lt", "mitsuba:path"]);
        let path = folder.join("report.html");
        report::write(&results, &folder, &path).unwrap();
        let page = Page { chromium, _turn: turn };
        let size =
            json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600 });
        page.chromium.call("Emulation.setDeviceMetricsOverride", size);
        page.chromium.call("Page.navigate", json!({ "url": format!("file://{}", path.display()) }));
        page.wait("document.querySelector('#s0 [data-stage]')?.dataset.loaded === 'true'");
        page.wait("document.querySelector('#s0 [data-plot]').dataset.curves === '4'");
        Some(page)
    }

    fn eval(&self, expression: &str) -> Value {
        self.chromium.evaluate(expression)
    }

    /// Waits until an expression is true.
    fn wait(&self, expression: &str) {
        let begin = Instant::now();
        while self.eval(&format!("Boolean({expression})")) != Value::Bool(true) {
            assert!(begin.elapsed() < Duration::from_secs(600), "never true: {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until the page has been painted again.
    fn settle(&self) {
        self.eval("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))");
    }

    fn focus(&self, selector: &str) {
        self.eval(&format!("document.querySelector('{selector}').focus()"));
    }

    fn press(&self, key: &str) {
        self.chromium.press(key);
        self.settle();
    }

    /// Moves the pressed pointer from the middle of an element to the right.
    fn drag(&self, selector: &str, by: f64) {
        self.eval(&format!("document.querySelector('{selector}').scrollIntoView({{block: 'center', behavior: 'instant'}})"));
        self.settle();
        let middle = |side: &str, size: &str| {
            let b = format!("document.querySelector('{selector}').getBoundingClientRect()");
            self.eval(&format!("{b}.{side} + {b}.{size} / 2")).as_f64().unwrap()
        };
        let (x, y) = (middle("left", "width"), middle("top", "height"));
        for (kind, x) in [("mousePressed", x), ("mouseMoved", x + by), ("mouseReleased", x + by)] {
            self.chromium.call(
                "Input.dispatchMouseEvent",
                json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 }),
            );
        }
        self.settle();
    }

    /// Red, green and blue of the pixel at these shares of the canvas of the visible scene.
    fn pixel(&self, x: f64, y: f64) -> Vec<f64> {
        self.settle();
        let value = self.eval(&format!(
            "(() => {{ const c = document.querySelector('.scene:not([hidden]) [data-canvas]');
               const copy = new OffscreenCanvas(1, 1).getContext('2d', {{ willReadFrequently: true }});
               copy.drawImage(c, -Math.floor({x} * c.width), -Math.floor({y} * c.height));
               return [...copy.getImageData(0, 0, 1, 1).data].slice(0, 3).join(' '); }})()"
        ));
        value.as_str().unwrap().split(' ').map(|v| v.parse().unwrap()).collect()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // A second panic would hide the first.
        if !std::thread::panicking() {
            let complaints = self.chromium.complaints();
            assert!(complaints.is_empty(), "{complaints:?}");
        }
    }
}

#[test]
fn the_line_between_two_images_follows_pointer_and_keys() {
    let Some(page) = Page::open("line", 1280) else { return };
    // The page sets it after its images are there.
    page.wait("document.querySelector('[data-split]').ariaValueNow === '50'");
    // On the right of the middle the noise-free reference, after the drag the noisy left image.
    let before = page.pixel(0.6, 0.3);
    page.drag("[data-split]", 200.0);
    page.wait("Number(document.querySelector('[data-split]').ariaValueNow) > 65");
    assert_ne!(page.pixel(0.6, 0.3), before);
    page.focus("[data-split]");
    for (key, at) in [("Home", "0"), ("ArrowRight", "2"), ("End", "100")] {
        page.press(key);
        page.wait(&format!("document.querySelector('[data-split]').ariaValueNow === '{at}'"));
    }
}

#[test]
fn curves_are_switched_for_all_scenes() {
    let Some(page) = Page::open("curves", 1280) else { return };
    page.focus("#s0 [data-toggle=\"bdpt\"]");
    page.press(" ");
    page.wait("document.querySelector('#s0 [data-plot]').dataset.curves === '3'");
    let label = page.eval("document.querySelector('#s0 [data-plot]').ariaLabel");
    assert!(
        !label.as_str().unwrap().contains("bdpt") && label.as_str().unwrap().contains("pt: MSE")
    );
    page.eval("document.getElementById('tab-1').click()");
    page.wait("document.querySelector('#s1 [data-plot]').dataset.curves === '3'");
    page.eval("document.querySelector('#s1 [data-toggle=\"bdpt\"]').click()");
    page.wait("document.querySelector('#s1 [data-plot]').dataset.curves === '4'");
    // FLIP is known of all but one integrator.
    page.eval("(() => { const s = document.querySelector('#s1 [data-mount=curves] select'); s.value = 'flip'; s.dispatchEvent(new Event('change')); })()");
    page.wait("document.querySelector('#s1 [data-plot]').dataset.curves === '3'");
}

#[test]
fn exposure_is_shared_by_all_images_and_scenes() {
    let Some(page) = Page::open("exposure", 1280) else { return };
    let before = page.pixel(0.9, 0.9);
    page.focus("#s0 [data-exposure]");
    for _ in 0..4 {
        page.press("ArrowLeft");
    }
    let darker = page.pixel(0.9, 0.9);
    // One stop: half the radiance, a step on the transfer curve of sRGB.
    let linear = |v: f64| ((v / 255.0 + 0.055) / 1.055).powf(2.4);
    for (b, d) in before.iter().zip(&darker) {
        assert!((linear(*d) / linear(*b) - 0.5).abs() < 0.03, "{before:?} {darker:?}");
    }
    page.eval("document.getElementById('tab-1').click()");
    page.wait("document.querySelector('#s1 [data-exposure]')?.value === '-1'");
}

#[test]
fn tabs_follow_the_arrow_keys() {
    let Some(page) = Page::open("tabs", 1280) else { return };
    page.focus("#tab-0");
    page.press("ArrowRight");
    assert_eq!(page.eval("document.activeElement.id"), "tab-1");
    assert_eq!(page.eval("document.getElementById('tab-1').ariaSelected"), "true");
    assert_eq!(page.eval("document.getElementById('s0').hidden"), true);
    assert_eq!(page.eval("document.getElementById('s1').hidden"), false);
    page.press("Home");
    assert_eq!(page.eval("document.getElementById('s0').hidden"), false);
}

#[test]
fn false_colours_and_zoom_change_the_picture() {
    let Some(page) = Page::open("modes", 1280) else { return };
    let mut seen = vec![page.pixel(0.2, 0.5)];
    for mode in ["sigma", "error", "difference"] {
        page.eval(&format!("document.querySelector('#s0 input[value={mode}]').click()"));
        let pixel = page.pixel(0.2, 0.5);
        assert!(!seen.contains(&pixel), "{mode}: {seen:?} {pixel:?}");
        seen.push(pixel);
    }
    page.eval("document.querySelector('#s0 input[value=image]').click()");
    assert_eq!(page.pixel(0.2, 0.5), seen[0]);
    page.focus("#s0 [data-canvas]");
    for _ in 0..6 {
        page.press("+");
    }
    page.press("ArrowRight");
    assert!(page.eval("report.state.view.zoom").as_f64().unwrap() > 10.0);
    assert!(page.eval("report.state.view.x").as_f64().unwrap() > 0.5);
    let text = page.eval("document.querySelector('#s0 .readout').textContent");
    assert!(text.as_str().unwrap().starts_with("pixel (5"), "{text}");
}

#[test]
fn orange_is_where_the_left_image_is_brighter() {
    let Some(page) = Page::open("signs", 1280) else { return };
    let red_over_blue = |left: f64, right: f64| {
        let grey = |v: f64| {
            format!(
                "{{ width: 1, height: 1, linear: true, sigma: null, r: [{v}], g: [{v}], b: [{v}] }}"
            )
        };
        page.eval(&format!(
            "(() => {{ const c = document.createElement('canvas');
               report.tone.paint(c, 'difference', {}, {}, null, {{ exposure: 1, level: 1 }});
               const [r, , b] = c.getContext('2d').getImageData(0, 0, 1, 1).data;
               return r - b; }})()",
            grey(left),
            grey(right)
        ))
        .as_f64()
        .unwrap()
    };
    assert!(red_over_blue(1.3, 1.0) > 60.0 && red_over_blue(1.0, 1.3) < -30.0);
    assert!(red_over_blue(1.0, 1.0).abs() < 20.0);
    // The right end of the scale is the positive one.
    let end = page.eval(
        "(() => { const c = document.createElement('canvas'); report.tone.legend(c, true);
           const [r, , b] = c.getContext('2d').getImageData(230, 0, 1, 1).data; return r - b; })()",
    );
    assert!(end.as_f64().unwrap() > 60.0);
}

#[test]
fn what_is_unpacked_is_what_was_rendered() {
    let Some(page) = Page::open("unpacked", 1280) else { return };
    // The lamp of the reference is (14, 12, 9) with little noise.
    page.eval("report.radiance(report.images[0].reference).then((r) => { window.lamp = [r.r, r.g, r.b].map((p) => p[5 * 96 + 48] / report.images[0].scale); })");
    page.wait("window.lamp");
    for (i, expected) in [14.0, 12.0, 9.0].into_iter().enumerate() {
        let value = page.eval(&format!("window.lamp[{i}]")).as_f64().unwrap();
        assert!((value / expected - 1.0).abs() < 0.02, "{value} {expected}");
    }
}

#[test]
fn tables_are_sorted_and_verdicts_open() {
    let Some(page) = Page::open("tables", 1280) else { return };
    let first = |row: &str| {
        let row = format!("document.querySelector('#s0 .sortable tbody {row} th')");
        page.eval(&format!("{row}.textContent.trim()"))
    };
    // Those that make a part of the image only stay below, whatever is sorted by.
    assert_eq!(first("tr"), "pt");
    page.focus("#s0 .sortable thead th:nth-child(3) button");
    page.press("Enter");
    assert_eq!((first("tr"), first(".partial")), ("pt".into(), "mitsuba:path* external".into()));
    page.press("Enter");
    assert_eq!((first("tr"), first(".partial")), ("pt".into(), "lt*".into()));
    page.focus("#s0 [data-pair]");
    page.press("Enter");
    page.wait("document.querySelector('dialog').open");
    let text = page.eval("document.querySelector('dialog').textContent");
    assert!(text.as_str().unwrap().contains("mirror images"), "{text}");
    page.press("Escape");
    page.wait("!document.querySelector('dialog').open");
}

#[test]
fn convergence_is_stepped_through_and_played() {
    let Some(page) = Page::open("convergence", 1280) else { return };
    let source = || page.eval("document.querySelector('#s0 .frames img').src");
    let last = source();
    page.focus("#s0 [data-frames]");
    page.press("ArrowLeft");
    assert_ne!(source(), last);
    page.eval("document.querySelector('#s0 [data-mount=convergence] button').click()");
    page.wait("document.querySelector('#s0 [data-frames]').value === '5'");
    assert_eq!(source(), last);
}

/// Printing waits for nothing: what stands on paper is drawn when it begins.
#[test]
fn all_scenes_are_drawn_for_paper() {
    let Some(page) = Page::open("paper", 1300) else { return };
    page.wait("document.querySelector('#s1 [data-stage]')?.dataset.loaded === 'true'");
    page.eval("dispatchEvent(new Event('beforeprint'))");
    let opaque = "(() => { const c = document.querySelector('#s1 [data-canvas]');
        return c.getContext('2d').getImageData(c.width / 4, c.height / 4, 1, 1).data[3]; })()";
    assert_eq!(page.eval(opaque), 255);
    page.eval("dispatchEvent(new Event('afterprint'))");
    assert_eq!(page.eval("document.getElementById('s1').hidden"), true);
}

#[test]
fn the_page_fits_a_phone_in_both_themes() {
    let Some(page) = Page::open("phone", 390) else { return };
    let wide = page.eval("document.documentElement.scrollWidth").as_f64().unwrap();
    assert!(wide <= 390.0, "{wide}");
    // Sizes are rounded to whole pixels.
    let cut =
        "[...document.querySelectorAll('.chart')].filter((c) => c.scrollWidth > c.clientWidth + 1)
        .map((c) => `${c.textContent.trim()}: ${c.scrollWidth} in ${c.clientWidth}`).join()";
    assert_eq!(page.eval(cut), "");
    let ground = || page.eval("getComputedStyle(document.body).backgroundColor");
    page.focus("#theme");
    page.press("Enter");
    let light = ground();
    page.press("Enter");
    assert_ne!(ground(), light);
    let missing = "[...document.images].filter((i) => !i.alt).length + [...document.querySelectorAll('canvas[role=img]:not([aria-label])')].length";
    assert_eq!(page.eval(missing), 0);
}
