//! The text header of image sequences with tracked tools: lines
//! `Seq_FrameNNNN_<Body>ToTrackerTransform = ` and 16 numbers, a 4 × 4 matrix by rows in millimetres, with the same key
//! and `Status` saying `OK` where the tool was seen, and `Seq_FrameNNNN_Timestamp` in seconds.

use jointscope_motion::{Pose, Recording};
use jointscope_recordings::Unit;

use super::transform;

pub(super) fn parse(text: &str, bodies: &[&'static str]) -> Result<Recording, String> {
    let mut times = Vec::new();
    let mut poses = vec![Vec::new(); bodies.len()];
    let entries = text.lines().filter_map(|line| line.strip_prefix("Seq_Frame")?.split_once(" = "));
    for (key, value) in entries {
        let Some((frame, what)) = key.split_once('_') else { continue };
        let frame: usize = frame.parse().map_err(|_| format!("`{frame}` is no frame"))?;
        if what == "Timestamp" {
            times.push(value.trim().parse().map_err(|_| format!("`{value}` is no time"))?);
            if times.len() != frame + 1 {
                return Err(format!("frame {frame} is out of order"));
            }
        }
        let Some((body, rest)) = what.split_once("ToTrackerTransform") else { continue };
        let Some(index) = bodies.iter().position(|name| *name == body) else { continue };
        let track: &mut Vec<Option<Pose>> = &mut poses[index];
        match rest {
            "" => {
                track.push(Some(pose(value)?));
                if track.len() != frame + 1 {
                    return Err(format!("{body}: frame {frame} is out of order"));
                }
            }
            "Status" if value.trim() != "OK" => {
                track.pop();
                track.push(None);
            }
            _ => {}
        }
    }
    transform::recording(Some(times), bodies.iter().copied().zip(poses).collect())
}

fn pose(matrix: &str) -> Result<Pose, String> {
    let numbers: Vec<f64> =
        matrix.split_whitespace().map(str::parse).collect::<Result<_, _>>().map_err(|_| format!("found `{matrix}`"))?;
    let ([a, b, c, _], []) = numbers.as_chunks() else { return Err(format!("needed 16 numbers, found `{matrix}`")) };
    transform::pose([*a, *b, *c], Unit::Millimetre)
}

#[cfg(test)]
mod tests {
    use jointscope_motion::Observation;

    use super::*;

    #[test]
    fn lost_tools_are_missing_and_other_tools_passed_over() {
        let frame = |number: u8, x: f64, status: &str| {
            format!(
                "Seq_Frame000{number}_OtherToTrackerTransform = none\n\
                 Seq_Frame000{number}_ProbeToTrackerTransform = 1 0 0 {x} 0 1 0 0 0 0 1 0 0 0 0 1\n\
                 Seq_Frame000{number}_ProbeToTrackerTransformStatus = {status}\n\
                 Seq_Frame000{number}_Timestamp = {number}.5\n"
            )
        };
        let text = format!("NDims = 3\n{}{}", frame(0, 250., "OK"), frame(1, 0., "MISSING"));
        let recording = parse(&text, &["Probe"]).expect("sound");
        assert_eq!(recording.times(), Some(&[0.5, 1.5][..]));
        let Observation::Poses(poses) = recording.bodies()[0].observation() else { panic!("poses") };
        assert_eq!((poses[0].map(|pose| pose.translation.x), poses[1]), (Some(0.25), None));
        assert!(parse("Seq_Frame0000_ProbeToTrackerTransform = 1 2 3\n", &["Probe"]).is_err());
    }
}
