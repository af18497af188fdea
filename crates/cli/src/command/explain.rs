//! Which pair `run --explain` means.

use jointscope_models::settings;

use crate::failure::Failure;

/// What may stand between the names of a pair; names may contain each of them.
const BETWEEN: [&str; 6] = [",", ", ", " - ", "-", "/", " / "];

/// The index of a pair by its two names, in either order.
///
/// Names are tried whole, so that "left-door,right-door" and, where it means one pair only, "left-door-right-door" do.
pub(super) fn find(wanted: &str, pairs: &[[String; 2]]) -> Result<usize, Failure> {
    let is_meant = |[a, b]: &[String; 2]| {
        let both = BETWEEN.iter().flat_map(|between| [format!("{a}{between}{b}"), format!("{b}{between}{a}")]);
        both.into_iter().any(|name| name == wanted)
    };
    let meant: Vec<usize> = (0..pairs.len()).filter(|&index| is_meant(&pairs[index])).collect();
    let name = |index: usize| format!("{},{}", pairs[index][0], pairs[index][1]);
    match meant[..] {
        [one] => Ok(one),
        [] => {
            /// Pairs that are listed.
            const LISTED: usize = 12;
            let known: Vec<String> = (0..pairs.len()).map(name).collect();
            let listed: Vec<&str> = known.iter().map(String::as_str).take(LISTED).collect();
            let error = settings::unknown("pair", wanted, 0..0, &listed);
            let more = known.len().saturating_sub(LISTED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let example = pairs.first().map_or_else(String::new, |_| format!(": --explain \"{}\"", name(0)));
            let help = format!(
                "{}{more}\nname the two bodies with a comma between them{example}",
                error.help.unwrap_or_default()
            );
            Err(Failure::usage_with_help(error.message, &help))
        }
        _ => {
            let all: Vec<String> = meant.iter().map(|&index| format!("`{}`", name(index))).collect();
            let message = format!("`{wanted}` may be several pairs: {}", all.join(", "));
            Err(Failure::usage_with_help(message, "name the two bodies with a comma between them"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(pairs: &[[&str; 2]]) -> Vec<[String; 2]> {
        pairs.iter().map(|pair| pair.map(String::from)).collect()
    }

    #[test]
    fn names_with_hyphens_and_commas_are_found_whole() {
        let pairs = pairs(&[["left-door", "right-door"], ["left-door", "frame"], ["a,b", "c"]]);
        for (wanted, index) in [
            ("left-door,right-door", 0),
            ("right-door,left-door", 0),
            ("left-door-right-door", 0),
            ("left-door - frame", 1),
            ("frame/left-door", 1),
            ("a,b,c", 2),
            ("a,b, c", 2),
        ] {
            assert_eq!(find(wanted, &pairs).ok(), Some(index), "{wanted}");
        }
        assert!(find("left-door,door", &pairs).is_err());
    }

    #[test]
    fn what_may_be_several_pairs_is_refused() {
        let pairs = pairs(&[["a-b", "c"], ["a", "b-c"]]);
        assert!(find("a-b-c", &pairs).is_err());
        assert_eq!(find("a,b-c", &pairs).ok(), Some(1));
    }
}
