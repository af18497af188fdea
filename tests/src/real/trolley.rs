//! A table of one body's poses: a line of names, then `time,x,y,z,qw,qx,qy,qz` with the time of day as text
//! (`YYYY-MM-DD H:MM:SS.sss`) and metres.

use jointscope_motion::{Pose, Recording};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::transform;

pub(super) fn parse(text: &str, body: &str) -> Result<Recording, String> {
    let mut times = Vec::new();
    let mut poses = Vec::new();
    for line in text.lines().skip(1) {
        let (time, numbers) = line.split_once(',').ok_or_else(|| format!("found `{line}`"))?;
        times.push(seconds_of_day(time).ok_or_else(|| format!("`{time}` is no time"))?);
        let numbers: Vec<f64> = numbers
            .split(',')
            .map(|cell| cell.trim().parse())
            .collect::<Result<_, _>>()
            .map_err(|_| format!("needed numbers, found `{line}`"))?;
        let [x, y, z, qw, qx, qy, qz] = numbers[..] else { return Err(format!("needed 7 numbers, found `{line}`")) };
        let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 0.5);
        poses.push(rotation.map(|rotation| Pose::from_parts(Translation3::new(x, y, z), rotation)));
    }
    transform::recording(Some(times), vec![(body, poses)])
}

fn seconds_of_day(time: &str) -> Option<f64> {
    let (_, clock) = time.split_once(' ')?;
    clock.split(':').try_fold(0.0, |sum, part| Some(60.0 * sum + part.parse::<f64>().ok()?))
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    #[test]
    fn the_time_of_day_becomes_seconds_and_the_scalar_comes_first() {
        let text = "time,x,y,z,rotation,,,\n2022-08-15 9:42:22.5,1,2,3,0,0,0,1\n2022-08-15 9:42:23.0,1,2,3,0,0,0,0\n";
        let recording = parse(text, "trolley").expect("sound");
        assert_eq!(recording.times(), Some(&[34942.5, 34943.0][..]));
        let Observation::Poses(poses) = recording.bodies()[0].observation() else { panic!("poses") };
        let first = poses[0].expect("a pose");
        assert_eq!((first.translation.z, first.rotation.k, poses[1]), (3.0, 1.0, None));
        assert!(parse("time\nnoon,1,2,3,1,0,0,0\n", "trolley").is_err());
    }
}
