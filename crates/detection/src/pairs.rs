//! The pairs of a recording.

use jointscope_motion::{Body, MotionError, Recording};

use crate::DetectionError;

/// Name of the body at rest that a recording of one body is analysed against.
pub(crate) const WORLD: &str = "world";

/// Two bodies of a recording, by their index, the reference first.
pub(crate) type Pair = (usize, usize);

/// The pairs asked for, or all; the world, where there will be one, counts as the first body.
pub(crate) fn chosen(recording: &Recording, pairs: Option<&[[String; 2]]>) -> Result<Vec<Pair>, DetectionError> {
    let names = names_of(recording);
    if let [WORLD, WORLD] = names[..] {
        return Err(DetectionError::World(MotionError::DuplicateName { body: WORLD.into() }));
    }
    match pairs {
        Some(pairs) => pairs.iter().map(|pair| find_pair(&names, pair)).collect(),
        None => Ok((0..names.len()).flat_map(|i| (i + 1..names.len()).map(move |j| (i, j))).collect()),
    }
}

/// The bodies' names, with that of the world where there will be one.
pub(crate) fn names_of(recording: &Recording) -> Vec<&str> {
    let mut names: Vec<&str> = recording.bodies().iter().map(Body::name).collect();
    if names.len() == 1 {
        names.insert(0, WORLD);
    }
    names
}

fn find_pair(names: &[&str], [reference, moving]: &[String; 2]) -> Result<Pair, DetectionError> {
    let find = |name: &String| {
        names.iter().position(|other| other == name).ok_or_else(|| DetectionError::UnknownBody {
            name: name.clone(),
            known: names.iter().map(ToString::to_string).collect(),
        })
    };
    if reference == moving {
        return Err(DetectionError::PairOfOne { name: reference.clone() });
    }
    Ok((find(reference)?, find(moving)?))
}
