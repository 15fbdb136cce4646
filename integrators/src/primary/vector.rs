//! Points of primary sample space, realised coordinate by coordinate.

use pathspace_core::random::{PrimarySample, RandomStream, Stream};

use super::kernel::{GRID, Kernel, Perturbation};
use crate::chain::{Reader, Writer};

/// A coordinate as it was when it was last needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Coordinate {
    /// Multiple of 2⁻²⁴.
    value: u32,
    /// Time of the value.
    time: u32,
}

/// A point of [0, 1)^∞ for each [`Stream`], of which only the coordinates that were ever read
/// exist.
///
/// Every accepted move advances the time by one and mutates *all* coordinates. Those that the move
/// did not read are brought up to date when they are needed (Kelemen et al. 2002, §4.2): by as many
/// perturbations as moves have passed, or by a uniform number where a large step was among them.
/// Unlike there, a coordinate of the *current* point that is brought up to date stays so when the
/// proposal is rejected; forgetting it would let the rejection choose among values that the chain
/// has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PrimaryVector {
    streams: [Vec<Coordinate>; Stream::COUNT],
    /// Accepted moves since the last large step, which leaves no coordinate older than itself.
    time: u32,
}

impl PrimaryVector {
    /// The coordinate `index` of a stream, if it was ever read.
    pub fn get(&self, stream: Stream, index: usize) -> Option<f32> {
        self.streams[stream as usize].get(index).map(|c| to_unit(c.value))
    }

    /// Sets the coordinate `index` of a stream, where all before it exist, at the present time.
    pub fn set(&mut self, stream: Stream, index: usize, value: f32) {
        let value = ((value as f64 * GRID) as u32).min((1 << super::kernel::BITS) - 1);
        let coordinate = Coordinate { value, time: self.time };
        let list = &mut self.streams[stream as usize];
        if let Some(c) = list.get_mut(index) {
            *c = coordinate;
        } else if index == list.len() {
            list.push(coordinate);
        }
    }

    /// Makes this a point of which nothing is known.
    fn begin_large(&mut self) {
        self.streams.iter_mut().for_each(Vec::clear);
        self.time = 0;
    }

    /// Makes this a copy one move later.
    fn begin_small(&mut self, from: &PrimaryVector) {
        for (to, from) in self.streams.iter_mut().zip(&from.streams) {
            to.clone_from(from);
        }
        self.time = from.time;
        if self.time == u32::MAX {
            // What has not been read for half of all moves is uniform by now.
            for c in self.streams.iter_mut().flatten() {
                c.time = c.time.saturating_sub(1 << 31);
            }
            self.time -= 1 << 31;
        }
        self.time += 1;
    }

    /// The coordinate brought up to date.
    #[inline]
    fn realise(
        &mut self,
        stream: usize,
        index: usize,
        kernel: Perturbation,
        u: &mut RandomStream,
    ) -> u32 {
        let time = self.time;
        let list = &mut self.streams[stream];
        match list.get_mut(index) {
            Some(c) => {
                if c.time != time {
                    c.value = kernel.apply(c.value, time - c.time, u);
                    c.time = time;
                }
                c.value
            }
            None => {
                // Coordinates are read one after the other: `index` is the first missing one.
                let value = uniform(u);
                list.push(Coordinate { value, time });
                value
            }
        }
    }

    /// Writes all of it.
    pub fn encode(&self, w: &mut Writer) {
        w.u32(self.time);
        for list in &self.streams {
            w.len(list.len());
            for c in list {
                w.u32(c.value);
                w.u32(c.time);
            }
        }
    }

    /// Reads what [`PrimaryVector::encode`] wrote; `None` where the bytes are no vector.
    pub fn decode(r: &mut Reader<'_>) -> Option<Self> {
        let mut vector = PrimaryVector { time: r.u32()?, ..Default::default() };
        for list in &mut vector.streams {
            for _ in 0..r.len(8)? {
                let c = Coordinate { value: r.u32()?, time: r.u32()? };
                if c.value >> super::kernel::BITS != 0 || c.time > vector.time {
                    return None;
                }
                list.push(c);
            }
        }
        Some(vector)
    }
}

fn uniform<U: PrimarySample + ?Sized>(u: &mut U) -> u32 {
    (u.next() as f64 * GRID) as u32
}

fn to_unit(value: u32) -> f32 {
    value as f32 * (1.0 / GRID as f32)
}

/// Reads fresh uniform numbers and keeps them: the bootstrap.
pub struct Recorder<'a, U: ?Sized> {
    vector: &'a mut PrimaryVector,
    u: &'a mut U,
    stream: usize,
}

impl<'a, U: PrimarySample + ?Sized> Recorder<'a, U> {
    /// Records into an empty vector.
    pub fn new(vector: &'a mut PrimaryVector, u: &'a mut U) -> Self {
        Recorder { vector, u, stream: 0 }
    }
}

impl<U: PrimarySample + ?Sized> PrimarySample for Recorder<'_, U> {
    #[inline]
    fn next(&mut self) -> f32 {
        let value = uniform(self.u);
        self.vector.streams[self.stream].push(Coordinate { value, time: 0 });
        to_unit(value)
    }

    #[inline]
    fn stream(&mut self, stream: Stream) {
        self.stream = stream as usize;
        self.u.stream(stream);
    }
}

/// Reads the coordinates of a point as they are. One that the point does not have is 0: an
/// evaluation that the point was made by reads none.
pub struct Reading<'a> {
    vector: &'a PrimaryVector,
    stream: Stream,
    read: [usize; Stream::COUNT],
}

impl<'a> Reading<'a> {
    /// From the first coordinate of every stream on.
    pub fn new(vector: &'a PrimaryVector) -> Self {
        Reading { vector, stream: Stream::Sensor, read: [0; Stream::COUNT] }
    }
}

impl PrimarySample for Reading<'_> {
    fn next(&mut self) -> f32 {
        let index = &mut self.read[self.stream as usize];
        *index += 1;
        self.vector.get(self.stream, *index - 1).unwrap_or(0.0)
    }

    fn stream(&mut self, stream: Stream) {
        self.stream = stream;
    }
}

/// Reads the coordinates of a proposal y while it moves away from the current point x.
pub struct Moving<'a> {
    from: &'a mut PrimaryVector,
    to: &'a mut PrimaryVector,
    kernel: Perturbation,
    large: bool,
    u: &'a mut RandomStream,
    stream: usize,
    read: [usize; Stream::COUNT],
    held: Option<(usize, usize)>,
}

impl<'a> Moving<'a> {
    /// A large step, that forgets x: all coordinates are uniform.
    pub fn large(
        from: &'a mut PrimaryVector,
        to: &'a mut PrimaryVector,
        u: &'a mut RandomStream,
    ) -> Self {
        to.begin_large();
        let read = [0; Stream::COUNT];
        let kernel = Kernel::KELEMEN.prepare();
        Moving { from, to, kernel, large: true, u, stream: 0, read, held: None }
    }

    /// A small step: each coordinate is perturbed by `kernel`.
    pub fn small(
        from: &'a mut PrimaryVector,
        to: &'a mut PrimaryVector,
        kernel: Kernel,
        u: &'a mut RandomStream,
    ) -> Self {
        to.begin_small(from);
        let read = [0; Stream::COUNT];
        let kernel = kernel.prepare();
        Moving { from, to, kernel, large: false, u, stream: 0, read, held: None }
    }

    /// Gives a coordinate of a large step a value of its own, before it is read.
    pub fn set(&mut self, stream: Stream, index: usize, value: f32) {
        self.to.set(stream, index, value);
    }

    /// Keeps a coordinate of a small step as it is.
    pub fn hold(&mut self, stream: Stream, index: usize) {
        self.held = Some((stream as usize, index));
    }
}

impl PrimarySample for Moving<'_> {
    #[inline]
    fn next(&mut self) -> f32 {
        let (stream, index) = (self.stream, self.read[self.stream]);
        self.read[stream] += 1;
        let value = if self.large {
            match self.to.streams[stream].get(index) {
                Some(c) => c.value,
                None => self.to.realise(stream, index, self.kernel, self.u),
            }
        } else {
            let current = self.from.realise(stream, index, self.kernel, self.u);
            let value = if self.held == Some((stream, index)) {
                current
            } else {
                self.kernel.apply(current, 1, self.u)
            };
            let c = Coordinate { value, time: self.to.time };
            let list = &mut self.to.streams[stream];
            match list.get_mut(index) {
                Some(old) => *old = c,
                None => list.push(c),
            }
            value
        };
        to_unit(value)
    }

    #[inline]
    fn stream(&mut self, stream: Stream) {
        self.stream = stream as usize;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pathspace_core::random::Address;

    const SIGMA: f64 = 0.01;
    const KERNEL: Kernel = Kernel::Gaussian { sigma: SIGMA };

    fn stream(item: u64) -> RandomStream {
        RandomStream::new(Address { seed: 1, step: 0, item })
    }

    fn read(n: usize, u: &mut impl PrimarySample) {
        for _ in 0..n {
            u.next();
        }
    }

    fn recorded(n: usize, u: &mut RandomStream) -> PrimaryVector {
        let mut x = PrimaryVector::default();
        let mut recorder = Recorder::new(&mut x, u);
        read(n, &mut recorder);
        x
    }

    /// An accepted small step that reads `n` coordinates of the sensor stream.
    fn accept_small(x: &mut PrimaryVector, n: usize, u: &mut RandomStream) {
        let mut y = PrimaryVector::default();
        let mut moving = Moving::small(x, &mut y, KERNEL, u);
        read(n, &mut moving);
        *x = y;
    }

    fn distance(a: f32, b: f32) -> f64 {
        let d = (a as f64 - b as f64).abs();
        d.min(1.0 - d)
    }

    #[test]
    fn a_coordinate_left_alone_for_three_moves_has_moved_four_times_when_proposed() {
        let n = 20_000;
        let (mut current, mut proposed) = (0.0, 0.0);
        for item in 0..n {
            let mut u = stream(item);
            let mut x = recorded(2, &mut u);
            let start = x.get(Stream::Sensor, 1).unwrap();
            (0..3).for_each(|_| accept_small(&mut x, 1, &mut u));
            let mut y = PrimaryVector::default();
            let mut moving = Moving::small(&mut x, &mut y, KERNEL, &mut u);
            moving.next();
            proposed += distance(moving.next(), start).powi(2);
            current += distance(x.get(Stream::Sensor, 1).unwrap(), start).powi(2);
        }
        let moves = |sum: f64| sum / n as f64 / (SIGMA * SIGMA);
        assert!((moves(current) - 3.0).abs() < 0.15, "{}", moves(current));
        assert!((moves(proposed) - 4.0).abs() < 0.2, "{}", moves(proposed));
    }

    #[test]
    fn a_rejected_proposal_leaves_the_point_as_it_was() {
        let mut u = stream(1);
        let mut x = recorded(5, &mut u);
        let before = x.clone();
        let mut y = PrimaryVector::default();
        let mut moving = Moving::small(&mut x, &mut y, KERNEL, &mut u);
        read(5, &mut moving);
        assert_eq!(x, before);
        let mut moving = Moving::large(&mut x, &mut y, &mut u);
        read(9, &mut moving);
        assert_eq!(x, before);
    }

    #[test]
    fn a_coordinate_brought_up_to_date_keeps_its_value_for_the_next_proposal() {
        let mut u = stream(2);
        let mut x = recorded(3, &mut u);
        accept_small(&mut x, 1, &mut u);
        let mut values = (0..2).map(|_| {
            let mut y = PrimaryVector::default();
            let mut moving = Moving::small(&mut x, &mut y, KERNEL, &mut u);
            read(3, &mut moving);
            x.get(Stream::Sensor, 2)
        });
        assert_eq!(values.next(), values.next());
    }

    #[test]
    fn large_steps_forget_what_they_did_not_read() {
        let n = 4000;
        let far = (0..n).filter(|&item| {
            let mut u = stream(item);
            let mut x = recorded(2, &mut u);
            let start = x.get(Stream::Sensor, 1).unwrap();
            let mut y = PrimaryVector::default();
            Moving::large(&mut x, &mut y, &mut u).next();
            let mut moving = Moving::small(&mut y, &mut x, KERNEL, &mut u);
            moving.next();
            distance(moving.next(), start) > 0.25
        });
        let share = far.count() as f64 / n as f64;
        assert!((share - 0.5).abs() < 0.04, "{share}");
    }

    #[test]
    fn streams_do_not_shift_each_other() {
        let mut u = stream(3);
        let mut x = PrimaryVector::default();
        let mut recorder = Recorder::new(&mut x, &mut u);
        recorder.next();
        recorder.stream(Stream::Light);
        let light = recorder.next();
        recorder.stream(Stream::Sensor);
        let second = recorder.next();
        assert_eq!(x.get(Stream::Light, 0), Some(light));
        assert_eq!(x.get(Stream::Sensor, 1), Some(second));
        assert_eq!(x.get(Stream::Light, 1), None);
    }

    #[test]
    fn a_coordinate_that_is_held_stays_and_the_others_move() {
        let mut u = stream(5);
        let mut x = recorded(3, &mut u);
        let before: Vec<f32> = {
            let mut reading = Reading::new(&x);
            (0..3).map(|_| reading.next()).collect()
        };
        let mut y = PrimaryVector::default();
        let mut moving = Moving::small(&mut x, &mut y, KERNEL, &mut u);
        moving.hold(Stream::Sensor, 1);
        let after: Vec<f32> = (0..3).map(|_| moving.next()).collect();
        let same: Vec<bool> = before.iter().zip(&after).map(|(a, b)| a == b).collect();
        assert_eq!(same, [false, true, false]);
        assert_eq!(y.get(Stream::Sensor, 1), x.get(Stream::Sensor, 1));
    }

    #[test]
    fn vectors_survive_their_bytes() {
        let mut u = stream(4);
        let mut x = recorded(5, &mut u);
        accept_small(&mut x, 7, &mut u);
        let mut w = Writer::new();
        x.encode(&mut w);
        let bytes = w.into_bytes();
        assert_eq!(PrimaryVector::decode(&mut Reader::new(&bytes)), Some(x));
        assert_eq!(PrimaryVector::decode(&mut Reader::new(&bytes[1..])), None);
    }
}
