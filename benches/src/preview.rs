//! Live preview in the viewer tev, by its TCP protocol.
//!
//! A thread of its own talks to the viewer: a slow one shows fewer images, one that goes away is
//! told of once, and rendering waits for neither.

use std::io;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use pathspace_core::film::Film;
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};
use thiserror::Error;

/// Port that tev listens at unless told otherwise.
const PORT: u16 = 14158;
/// Time between images.
const EVERY: Duration = Duration::from_secs(1);
/// A viewer that takes nothing for so long has gone away.
const PATIENCE: Duration = Duration::from_secs(5);
/// Most numbers in a packet: images are sent in bands of rows.
const BAND: usize = 1 << 18;
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// No viewer to talk to.
#[derive(Debug, Error)]
#[error("{address}: cannot show images: {reason} (is tev running there?)")]
pub struct PreviewError {
    /// Where it should have been.
    pub address: String,
    /// The system's reason.
    pub reason: String,
}

/// A connection to a viewer.
#[derive(Debug)]
pub struct Preview {
    address: String,
    images: Option<SyncSender<Vec<f32>>>,
    failure: Receiver<io::Error>,
    thread: Option<JoinHandle<()>>,
    last: Option<Instant>,
}

impl Preview {
    /// Connects to the viewer at `host:port` (tev's own port where none is given), and opens an
    /// image of the size of the film's window in it.
    ///
    /// # Errors
    /// Where nobody listens there.
    pub fn open(address: &str, name: &str, film: &Film) -> Result<Preview, PreviewError> {
        let failed = |e: io::Error| PreviewError { address: address.into(), reason: e.to_string() };
        let stream = connect(address).map_err(failed)?;
        let mut viewer = Viewer {
            client: TevClient::wrap(stream),
            // The protocol ends names with a zero.
            name: name.replace('\0', "?"),
            width: film.width(),
            height: film.height(),
        };
        viewer.create().map_err(failed)?;
        let (images, inbox) = mpsc::sync_channel::<Vec<f32>>(1);
        let (report, failure) = mpsc::channel();
        let thread = std::thread::spawn(move || {
            for image in inbox {
                if let Err(error) = viewer.update(&image) {
                    // Nobody listens where the render has ended.
                    let _ = report.send(error);
                    return;
                }
            }
        });
        Ok(Preview {
            address: address.into(),
            images: Some(images),
            failure,
            thread: Some(thread),
            last: None,
        })
    }

    /// Shows the film where it is time to. Says once that the viewer has gone away.
    pub fn now_and_then(&mut self, film: &Film) -> Option<String> {
        if self.images.is_some() && self.last.is_none_or(|last| last.elapsed() >= EVERY) {
            self.last = Some(Instant::now());
            if let Some(Err(TrySendError::Disconnected(_))) =
                self.images.as_ref().map(|images| images.try_send(pixels(film)))
            {
                self.images = None;
            }
        }
        self.gone()
    }

    /// Shows the film for the last time, and waits until the viewer has it or is given up.
    pub fn finish(mut self, film: &Film) -> Option<String> {
        if let Some(images) = self.images.take() {
            // Where it fails, the viewer has gone away, and the thread has said why.
            let _ = images.send(pixels(film));
        }
        self.close();
        self.gone()
    }

    fn close(&mut self) {
        self.images = None;
        if let Some(thread) = self.thread.take() {
            // It does not panic, and if it did, there would be no image to lose.
            let _ = thread.join();
        }
    }

    fn gone(&mut self) -> Option<String> {
        let error = self.failure.try_recv().ok()?;
        self.images = None;
        Some(format!("{}: shows no more images: {error}", self.address))
    }
}

impl Drop for Preview {
    fn drop(&mut self) {
        self.close();
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let full = if address.contains(':') { address.into() } else { format!("{address}:{PORT}") };
    let mut error = io::Error::new(io::ErrorKind::NotFound, "no such host");
    for place in full.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                return Ok(stream);
            }
            Err(e) => error = e,
        }
    }
    Err(error)
}

/// The image in 32-bit floats, channel by channel in each pixel.
fn pixels(film: &Film) -> Vec<f32> {
    film.image().iter().flatten().map(|v| *v as f32).collect()
}

struct Viewer {
    client: TevClient,
    name: String,
    width: usize,
    height: usize,
}

impl Viewer {
    fn create(&mut self) -> io::Result<()> {
        self.client.send(PacketCreateImage {
            image_name: &self.name,
            grab_focus: true,
            width: self.width as u32,
            height: self.height as u32,
            channel_names: &CHANNELS,
        })
    }

    fn update(&mut self, pixels: &[f32]) -> io::Result<()> {
        let row = CHANNELS.len() * self.width;
        let rows = (BAND / row).max(1);
        for (band, data) in pixels.chunks(rows * row).enumerate() {
            self.client.send(PacketUpdateImage {
                image_name: &self.name,
                grab_focus: false,
                channel_names: &CHANNELS,
                channel_offsets: &[0, 1, 2],
                channel_strides: &[3, 3, 3],
                x: 0,
                y: (band * rows) as u32,
                width: self.width as u32,
                height: (data.len() / row) as u32,
                data,
            })?;
        }
        Ok(())
    }
}
