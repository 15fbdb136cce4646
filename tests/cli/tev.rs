//! `pathspace render --tev`, with a small server in the place of the viewer that records what
//! comes.

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;

use crate::support::*;

/// A message of tev's protocol: length of all as 32 bits, kind, content; numbers little endian,
/// names end with 0.
struct Message {
    kind: u8,
    content: Vec<u8>,
    at: usize,
}

impl Message {
    fn read(stream: &mut TcpStream) -> Option<Message> {
        let mut length = [0; 4];
        stream.read_exact(&mut length).ok()?;
        let mut content = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut content).ok()?;
        Some(Message { kind: content[0], content, at: 1 })
    }

    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        self.at += N;
        self.content[self.at - N..self.at].try_into().unwrap()
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn text(&mut self) -> String {
        let rest = &self.content[self.at..];
        let text = &rest[..rest.iter().position(|b| *b == 0).unwrap()];
        self.at += text.len() + 1;
        String::from_utf8(text.to_vec()).unwrap()
    }
}

/// What a viewer would show.
#[derive(Default)]
struct Shown {
    name: String,
    size: (u32, u32),
    channels: Vec<String>,
    /// Interleaved.
    pixels: Vec<f32>,
    updates: usize,
}

impl Shown {
    fn take(&mut self, mut m: Message) {
        let _grab_focus = m.bytes::<1>();
        let name = m.text();
        match m.kind {
            // CreateImage
            4 => {
                self.name = name;
                self.size = (m.u32(), m.u32());
                self.channels = (0..m.u32()).map(|_| m.text()).collect();
                self.pixels = vec![0.0; (3 * self.size.0 * self.size.1) as usize];
            }
            // UpdateImageV3
            6 => {
                assert_eq!(name, self.name);
                let channels: Vec<String> = (0..m.u32()).map(|_| m.text()).collect();
                assert_eq!(channels, self.channels);
                let (x, y, width, height) = (m.u32(), m.u32(), m.u32(), m.u32());
                let places: Vec<u64> = (0..6).map(|_| u64::from_le_bytes(m.bytes())).collect();
                assert_eq!(places, [0, 1, 2, 3, 3, 3]);
                assert_eq!((x, width), (0, self.size.0));
                let begin = (3 * y * width) as usize;
                for i in 0..(3 * width * height) as usize {
                    self.pixels[begin + i] = f32::from_le_bytes(m.bytes());
                }
                assert_eq!(m.at, m.content.len());
                self.updates += 1;
            }
            other => panic!("message of kind {other}"),
        }
    }
}

/// Listens, and records up to `most` messages before it goes away.
fn viewer(most: usize) -> (String, JoinHandle<Shown>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let thread = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut shown = Shown::default();
        for _ in 0..most {
            let Some(message) = Message::read(&mut stream) else { break };
            shown.take(message);
        }
        shown
    });
    (address, thread)
}

#[test]
fn the_viewer_sees_the_image_grow_and_at_last_the_whole() {
    let folder = Folder::new();
    let out = folder.file("a.exr");
    let (address, thread) = viewer(usize::MAX);
    let args = ["render", "cornell-box", "--size", "20x14", "--crop", "2,1,16,12"];
    json(&[&args[..], &["--seconds", "2.5", "--tev", &address, "-o", &out, "--json"]].concat());
    let shown = thread.join().unwrap();
    assert_eq!((shown.name.as_str(), shown.size), (out.as_str(), (16, 12)));
    assert_eq!(shown.channels, ["R", "G", "B"]);
    assert!((2..=4).contains(&shown.updates), "{}", shown.updates);
    let exr = Exr::read(&out);
    for (c, name) in ["R", "G", "B"].iter().enumerate() {
        let last: Vec<f32> = shown.pixels.iter().skip(c).step_by(3).copied().collect();
        assert!(last == exr.channel(name), "{name}");
    }
}

#[test]
fn a_viewer_that_goes_away_costs_one_line() {
    let (address, thread) = viewer(2);
    let args = ["render", "cornell-box", "--size", "300x300", "--seconds", "4", "--max-depth", "2"];
    let output = run(&[&args[..], &["--tev", &address, "--json"]].concat());
    assert_eq!(thread.join().unwrap().updates, 1);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let message = stderr(&output);
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.starts_with(&format!("warning: {address}: shows no more images: ")));
    assert_eq!(last_line(&output)["complete"], true);
}

#[test]
fn no_viewer_is_told_before_the_rendering() {
    // Bound and let go: nobody listens there.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let output = run(&["render", "cornell-box", "--spp", "1000000000", "--tev", &address]);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.starts_with(&format!("error: {address}: cannot show images: ")), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
}
