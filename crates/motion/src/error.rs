//! What can be wrong with bodies and recordings.

/// Why bodies, recordings or their motion could not be built: what was needed, what was found, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The number of positions is not frames × features.
    #[error(
        "{found} positions do not fill frames of {features} features each; give one per feature and frame, NaN where missing"
    )]
    NotRectangular {
        /// Features per frame.
        features: usize,
        /// Positions given.
        found: usize,
    },
    /// A coordinate is infinite.
    #[error(
        "body `{body}`, feature `{feature}`, frame {frame}: a coordinate is infinite; leave missing samples out or NaN"
    )]
    Infinite {
        /// Body name.
        body: String,
        /// Feature label.
        feature: String,
        /// Index of the frame.
        frame: usize,
    },
    /// A coordinate is finite, but too large for squared distances to be finite.
    #[error(
        "body `{body}`, feature `{feature}`, frame {frame}: a coordinate of {value:e} m exceeds the largest, 1e60 m; check the unit"
    )]
    TooLarge {
        /// Body name.
        body: String,
        /// Feature label.
        feature: String,
        /// Index of the frame.
        frame: usize,
        /// The coordinate, metres.
        value: f64,
    },
    /// The number of labels differs from the number of features.
    #[error("body `{body}` has {features} features but {labels} feature labels")]
    LabelCount {
        /// Body name.
        body: String,
        /// Features in its tracks.
        features: usize,
        /// Labels given.
        labels: usize,
    },
    /// A frame has positions of another number of bodies.
    #[error(
        "a frame has positions of {found} bodies, where there are {expected}; give those of all bodies, NaN where missing"
    )]
    BodyCount {
        /// Bodies that are recorded.
        expected: usize,
        /// Bodies of which positions were given.
        found: usize,
    },
    /// A frame has another number of positions of a body than that has features.
    #[error(
        "a frame has {found} positions of body `{body}`, which has {expected} features; give one of each, NaN where missing"
    )]
    FeatureCount {
        /// Body name.
        body: String,
        /// Its features.
        expected: usize,
        /// Positions given.
        found: usize,
    },
    /// A body is never seen.
    #[error("body `{body}` has no sample in any frame; leave it out, or check its columns")]
    NeverSeen {
        /// Body name.
        body: String,
    },
    /// Two bodies have the same name.
    #[error("two bodies are named `{body}`; rename one of them")]
    DuplicateName {
        /// The name.
        body: String,
    },
    /// A body covers another number of frames than the recording.
    #[error("body `{body}` has {found} frames, the recording has {expected}")]
    FrameCount {
        /// Body name.
        body: String,
        /// Frames of the body.
        found: usize,
        /// Frames of the recording.
        expected: usize,
    },
    /// Frame numbers do not increase.
    #[error("frame numbers must increase, but {second} follows {first}")]
    FrameOrder {
        /// A frame number.
        first: u64,
        /// The number that follows it.
        second: u64,
    },
    /// The times do not fit the frames.
    #[error("the times of a recording must be one finite number per frame and never fall: {detail}")]
    Times {
        /// What was found.
        detail: String,
    },
    /// There is nothing to look at.
    #[error("a recording needs at least one body and one frame")]
    Empty,
}
