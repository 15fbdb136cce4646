//! Listening to an adapter, whatever it says and however much.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Longest answer, bytes.
const LINE: usize = 1 << 20;
/// Most bytes of other lines before an answer.
const CHATTER: usize = 1 << 26;
/// Bytes of stderr that are remembered.
const WORDS: usize = 4096;

/// What came on stdout.
pub(super) enum Said {
    /// A line that begins with `{`.
    Answer(String),
    /// More than the limits allow; nothing comes after it.
    TooMuch(&'static str),
}

/// The answers on stdout. Other lines are passed over: libraries print what they like.
pub(super) struct Stdout(Mutex<Receiver<Said>>);

impl Stdout {
    pub(super) fn listen(stdout: impl Read + Send + 'static) -> Self {
        // One that answers without being asked has to wait.
        let (to, from) = sync_channel(1);
        // It ends with the process, at the end of its output, or when nobody listens.
        std::thread::spawn(move || hear_lines(BufReader::new(stdout), &to));
        Stdout(Mutex::new(from))
    }

    /// Waits for an answer; disconnected at the end of the output.
    pub(super) fn hear(&mut self, wait: Duration) -> Result<Said, RecvTimeoutError> {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner).recv_timeout(wait)
    }

    /// Forgets answers that nobody has asked for.
    pub(super) fn forget(&mut self) {
        let from = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        while let Ok(Said::Answer(_)) = from.try_recv() {}
    }
}

fn hear_lines(mut stdout: impl BufRead, to: &SyncSender<Said>) {
    let mut chatter = 0;
    loop {
        let mut line = Vec::new();
        let read = (&mut stdout).take(LINE as u64 + 1).read_until(b'\n', &mut line);
        let said = match read {
            Ok(1..) if line.len() > LINE => {
                Said::TooMuch("it has written more than a megabyte to stdout without a new line")
            }
            Ok(1..) if line.trim_ascii_start().starts_with(b"{") => {
                chatter = 0;
                Said::Answer(String::from_utf8_lossy(&line).trim().to_owned())
            }
            Ok(1..) => {
                chatter += line.len();
                if chatter <= CHATTER {
                    continue;
                }
                Said::TooMuch("it has written more than 64 megabytes to stdout without an answer")
            }
            Ok(0) | Err(_) => return,
        };
        let last = matches!(said, Said::TooMuch(_));
        if to.send(said).is_err() || last {
            return;
        }
    }
}

/// The end of stderr.
pub(super) struct LastWords {
    end: Arc<Mutex<VecDeque<u8>>>,
    done: Mutex<Receiver<()>>,
}

impl LastWords {
    pub(super) fn listen(mut stderr: impl Read + Send + 'static) -> Self {
        let end = Arc::new(Mutex::new(VecDeque::new()));
        let (to, done) = sync_channel(1);
        let own = Arc::clone(&end);
        std::thread::spawn(move || {
            let mut bytes = [0; WORDS];
            while let Ok(n @ 1..) = stderr.read(&mut bytes) {
                let mut end = own.lock().unwrap_or_else(PoisonError::into_inner);
                end.extend(&bytes[..n]);
                let excess = end.len().saturating_sub(WORDS);
                end.drain(..excess);
            }
            // Nobody may be listening.
            let _ = to.send(());
        });
        LastWords { end, done: Mutex::new(done) }
    }

    /// The last line of one that has ended, after a colon.
    pub(super) fn tell(self) -> String {
        // A moment for what is still in the pipe; something it has started may hold it open.
        let done = self.done.into_inner().unwrap_or_else(PoisonError::into_inner);
        let _ = done.recv_timeout(Duration::from_millis(500));
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(end.make_contiguous());
        let last = text.lines().rev().find(|l| !l.trim().is_empty());
        last.map_or(String::new(), |l| format!(": {}", l.trim()))
    }
}
