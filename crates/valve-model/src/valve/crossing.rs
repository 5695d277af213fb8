//! Where within a sub-step the speed changes sign: there |ω| and sgn ω bend the equations, so a sub-step keeps the
//! direction it began with and ends where the speed is zero.
//!
//! The speed between a sub-step's ends is that of Rodas5P's continuous extension, of fourth order.

/// Weights of the stages in the continuous extension (Steinebach 2023), by power.
const EXTENSION: [[f64; 8]; 3] = [
    [
        25.948_786_856_663_858,
        -2.557_972_484_584_623_5,
        10.433_815_404_888_879,
        -2.367_925_102_268_520_4,
        0.524_948_541_321_073,
        1.124_108_831_045_040_4,
        0.427_287_619_443_187_4,
        -0.172_022_210_701_554_93,
    ],
    [
        -9.915_688_506_951_71,
        -0.968_994_459_411_515_4,
        3.043_803_724_297_845_3,
        -24.495_224_566_215_796,
        20.176_138_334_709_044,
        15.980_663_614_246_51,
        -6.789_040_303_419_874,
        -6.710_236_069_923_372,
    ],
    [
        11.419_903_575_922_262,
        2.887_964_514_613_699_4,
        72.921_379_959_960_29,
        80.125_118_346_226_43,
        -52.072_871_366_152_654,
        -59.789_936_252_667_29,
        -0.155_826_842_827_519_13,
        4.883_087_185_713_722,
    ],
];

/// Places within a sub-step at which the speed's sign is looked at, and halvings of the bracket found.
const PLACES: u32 = 8;
const HALVINGS: usize = 20;

/// The spool's speed throughout a sub-step, rad/s.
pub(super) struct Speeds {
    pub start: f64,
    pub end: f64,
    pub stages: [f64; 8],
}

/// What a sub-step taken in one direction turned out to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Course {
    /// It keeps its direction.
    Keeps,
    /// It should have gone the other way from the beginning.
    Opposite,
    /// It turns after `part` of its length, and goes up to `depth` rad/s the other way.
    Turns { part: f64, depth: f64 },
}

/// The speed as a polynomial of the part of the sub-step that is over.
struct Extension {
    start: f64,
    end: f64,
    inner: [f64; 3],
}

impl Extension {
    fn at(&self, part: f64) -> f64 {
        let [one, two, three] = self.inner;
        let rest = 1.0 - part;
        rest * self.start + part * (self.end + rest * (one + part * (two + part * three)))
    }
}

impl Speeds {
    /// The course of a sub-step in `direction` (±1), at whose beginning the speed changes by `change` rad/s in its length.
    #[inline]
    pub fn course(&self, direction: f64, change: f64) -> Course {
        let (start, end) = (direction * self.start, direction * self.end);
        if end >= 0.0 && (start <= 0.0 || start + direction * change >= 0.0) {
            return Course::Keeps;
        }
        self.turn(direction)
    }

    #[cold]
    fn turn(&self, direction: f64) -> Course {
        let inner =
            EXTENSION.map(|row| direction * row.iter().zip(&self.stages).map(|(a, b)| a * b).sum::<f64>());
        let speed = Extension { start: direction * self.start, end: direction * self.end, inner };
        let (mut ahead, mut depth) = (speed.start > 0.0, 0.0_f64);
        let (mut near, mut far) = (0.0, None);
        for place in 1..=PLACES {
            let part = f64::from(place) / f64::from(PLACES);
            let here = speed.at(part);
            depth = depth.max(-here);
            if here >= 0.0 && far.is_none() {
                (ahead, near) = (true, part);
            } else if here < 0.0 && ahead {
                far = far.or(Some(part));
            }
        }
        match far {
            None if ahead => Course::Keeps,
            None => Course::Opposite,
            Some(far) => Course::Turns { part: speed.zero(near, far), depth },
        }
    }
}

impl Extension {
    /// The zero between a part where the speed is not below it and one where it is; not before it.
    fn zero(&self, mut near: f64, mut far: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if self.at(middle) >= 0.0 {
                near = middle;
            } else {
                far = middle;
            }
        }
        far
    }
}
