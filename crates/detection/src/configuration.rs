//! The whole configuration, from one TOML text.

use std::{ops::Range, path::PathBuf, sync::Arc};

use jointscope_models::{
    Catalog, JointModel,
    settings::{self, SettingsError, Value},
};
use jointscope_motion::{DepthGainSetting, MotionSettings};
use jointscope_scoring::{Announcement, Rule, RuleError, RuleKind, ScoringSettings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::bodies::{self, Bodies};
use crate::place;
use crate::{ScaleSearch, ScaleSettings};

/// The models of a configuration without `[models]`.
pub(crate) const DEFAULT_MODELS: &str = "
    [rigid]
    [prismatic]
    [revolute]
    [screw]
    [cylindrical]
    [planar]
    [spherical]
    [disconnected]
    kind = \"free\"
";

/// The tables of a configuration.
pub(crate) const TABLES: [&str; 6] = ["recording", "motion", "scale", "models", "scoring", "output"];

/// Everything that decides how a recording is read and judged.
#[derive(Debug, Clone)]
pub struct Configuration {
    /// What to analyse.
    pub recording: RecordingSettings,
    /// How motion is recovered.
    pub motion: MotionSettings,
    /// How the unknown scales of a single camera are treated.
    pub scale: ScaleSettings,
    /// The models, sorted by name.
    pub models: Vec<NamedModel>,
    /// The rule that judges.
    pub rule: Rule,
    /// What is written.
    pub output: OutputSettings,
}

/// A joint model under the name that rules and results use.
#[derive(Debug, Clone)]
pub struct NamedModel {
    /// Its key under `[models]`.
    pub name: String,
    /// The name of its kind in the catalog.
    pub kind: String,
    /// The model.
    pub model: Arc<dyn JointModel>,
}

/// Which recording, and what of it, is analysed. Reading it is the program's task.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RecordingSettings {
    /// The file, relative to the configuration's folder.
    pub path: Option<PathBuf>,
    /// Format of the file, if its extension does not tell.
    #[schemars(with = "Option<String>")]
    pub format: Option<Spanned<String>>,
    /// Unit of the lengths in the file: "m", "cm", "mm" or "in"; results are always in metres.
    #[schemars(with = "Option<String>")]
    pub unit: Option<Spanned<String>>,
    /// Several files instead of one, each with its own bodies, relative to the configuration's folder.
    pub paths: Option<Vec<PathBuf>>,
    /// Which markers make which body: a list of patterns of their names for every body, such as `SWL:*`, or "suggest" to
    /// put those together that keep their distances; if left out, what the file itself tells.
    #[serde(deserialize_with = "bodies::deserialize")]
    #[schemars(with = "Option<bodies::Written>")]
    pub bodies: Option<Bodies>,
    /// Adds a body at rest of this name, as the first one.
    pub world: Option<String>,
    /// Pairs to analyse, the reference first; all pairs if left out.
    pub pairs: Option<Vec<[String; 2]>>,
    /// A simulated scene instead of a file.
    #[schemars(with = "Option<String>")]
    pub scene: Option<Spanned<String>>,
    /// Seed of the scene's noise.
    pub seed: Option<u64>,
    /// Noise of the scene, metres per coordinate.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise: Option<f64>,
    /// Frames of the scene.
    #[schemars(range(min = 2, max = 1_000_000))]
    pub frames: Option<usize>,
}

impl RecordingSettings {
    /// The files, one or several, relative to the configuration's folder; `None` if a scene or nothing is named.
    pub fn files(&self) -> Option<&[PathBuf]> {
        self.paths.as_deref().or(self.path.as_ref().map(std::slice::from_ref))
    }
}

/// What is written of the result. Writing it is the program's task.
#[allow(clippy::struct_excessive_bools, reason = "every file is a switch of its own")]
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutputSettings {
    /// The body from which the mechanism is seen, the root of robot descriptions; if left out, one at rest, or the one
    /// with most joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<String>,
    /// Whether `--out` writes report.html, a page with everything in pictures.
    pub html: bool,
    /// Whether `--out` writes report.svg, and pair-1.svg and so on.
    pub svg: bool,
    /// Whether `--out` writes mechanism.urdf.
    pub urdf: bool,
    /// Whether `--out` writes mechanism.xml, for the simulator `MuJoCo`.
    pub mjcf: bool,
    /// Whether `--out` writes recording.mcap, a log for viewers of robots; by programs built with the feature `mcap`.
    pub mcap: bool,
}

impl Configuration {
    /// The same for bodies that a single camera saw: depth gains are estimated, and scales sought, in closed form where
    /// all models state evidence and else by the grid.
    #[must_use]
    pub fn for_one_camera(mut self) -> Self {
        self.motion.depth_gain = DepthGainSetting::Estimate;
        let evidence = self.models.iter().all(|named| named.model.states_evidence());
        self.scale.search = if evidence { ScaleSearch::ClosedForm } else { ScaleSearch::Grid };
        self
    }

    /// Reads a configuration.
    ///
    /// # Errors
    /// [`SettingsError`] with the place in the text: syntax, unknown tables, keys, models or words, wrong types,
    /// numbers out of range, rules that do not fit the models.
    pub fn parse(text: &str, catalog: &Catalog) -> Result<Self, SettingsError> {
        let mut root = parse_table(text)?;
        if let Some((key, _)) = root.iter().find(|(key, _)| !TABLES.contains(&key.as_ref().as_ref())) {
            return Err(settings::unknown("table", key.as_ref(), key.span(), &TABLES));
        }
        let spans = key_spans(root.get("recording"));
        root.get("recording").map_or(Ok(()), check_pairs)?;
        let mut recording: RecordingSettings = table(&mut root, "recording")?;
        check_recording(&recording, &spans)?;
        root.get("motion").map_or(Ok(()), check_motion)?;
        let motion = table(&mut root, "motion")?;
        let scale_spans = key_spans(root.get("scale"));
        let scale: ScaleSettings = table(&mut root, "scale")?;
        let output = table(&mut root, "output")?;
        if recording.pairs.as_ref().is_some_and(Vec::is_empty) {
            recording.pairs = None;
        }
        let models = if let Some(models) = root.remove("models") {
            named_models(models, catalog)?
        } else {
            let defaults = DeValue::Table(parse_table(DEFAULT_MODELS)?);
            // What is wrong with the defaults is not in the user's text.
            let nowhere = |error| SettingsError { span: 0..0, ..error };
            named_models(Spanned::new(0..0, defaults), catalog).map_err(nowhere)?
        };
        check_scale(&scale, &models, &scale_spans)?;
        let spans = key_spans(root.get("scoring"));
        let scoring: ScoringSettings = table(&mut root, "scoring")?;
        check_scoring(&scoring, &spans)?;
        let rule = rule(&scoring, &models).map_err(|error| place::in_text(text, error))?;
        Ok(Self { recording, motion, scale, models, rule, output })
    }
}

/// Refuses true and false where a word or a number says more.
fn check_motion(motion: &Value<'_>) -> Result<(), SettingsError> {
    let allowed = [
        ("noise", "\"estimate\", or a number of metres"),
        ("depth_gain", "\"none\", \"estimate\", or a number"),
        ("play", "\"none\", a share such as \"0.7 %\", a number of metres, or a table"),
    ];
    for (key, allowed) in allowed {
        let value = motion.as_ref().as_table().and_then(|table| table.get(key));
        if let Some((value, switch)) = value.and_then(|value| Some((value, value.as_ref().as_bool()?))) {
            let message = format!("`{key}`: expected a word or a number, found {switch}");
            return Err(SettingsError::at(value.span(), message).help(format!("allowed: {allowed}")));
        }
    }
    Ok(())
}

/// Refuses pairs of less or more than two names or of one body, and pairs that are there twice.
fn check_pairs(recording: &Value<'_>) -> Result<(), SettingsError> {
    let pairs = recording.as_ref().as_table().and_then(|table| table.get("pairs")?.as_ref().as_array());
    let names = |pair: &Value<'_>| {
        let [reference, moving] = pair.as_ref().as_array()?.get(..)? else { return None };
        Some([reference.as_ref().as_str()?.to_owned(), moving.as_ref().as_str()?.to_owned()])
    };
    let mut before = Vec::new();
    for (pair, [reference, moving]) in pairs.into_iter().flatten().filter_map(|pair| Some((pair, names(pair)?))) {
        if reference == moving {
            let message = format!("the pair [`{reference}`, `{moving}`] names one body twice");
            let place = pair.as_ref().as_array().map_or(pair.span(), |names| names[0].span());
            return Err(SettingsError::at(place, message).help("name two bodies, the reference first"));
        }
        let named = [reference, moving];
        if before.contains(&named) {
            let message = format!("the pair [`{}`, `{}`] is there twice", named[0], named[1]);
            return Err(SettingsError::at(pair.span(), message).help("take one of them out"));
        }
        before.push(named);
    }
    let mut sizes = pairs.into_iter().flatten().filter_map(|pair| Some((pair, pair.as_ref().as_array()?.len())));
    match sizes.find(|(_, names)| *names != 2) {
        Some((pair, names)) => {
            let message = format!("`pairs`: a pair has two names, found {names}");
            Err(SettingsError::at(pair.span(), message).help("write [\"REFERENCE\", \"MOVING\"]"))
        }
        None => Ok(()),
    }
}

/// Refuses settings that contradict each other, rather than ignoring some.
fn check_recording(settings: &RecordingSettings, spans: &[(String, Range<usize>)]) -> Result<(), SettingsError> {
    let at = |key: &str, message: String| {
        let place = spans.iter().find(|(name, _)| name == key).map_or(0..0, |(_, span)| span.clone());
        SettingsError::at(place, message)
    };
    let idle = |keys: &[&'static str]| keys.iter().copied().find(|key| spans.iter().any(|(name, _)| name == key));
    if settings.path.is_some() && settings.paths.is_some() {
        let both = at("paths", "a recording is either a `path` or several `paths`, not both".into());
        return Err(both.help("put all files into `paths`"));
    }
    if settings.paths.as_ref().is_some_and(Vec::is_empty) {
        return Err(
            at("paths", "`paths` names no file".into()).help("for example: paths = [\"base.log\", \"lid.log\"]")
        );
    }
    if let Some(Bodies::Patterns(bodies)) = &settings.bodies {
        if bodies.is_empty() {
            let help = "for example: bodies.wheel = [\"wheel:*\"]";
            return Err(at("bodies", "`bodies` names no body".into()).help(help));
        }
        if let Some((name, _)) = bodies.iter().find(|(name, patterns)| name.trim().is_empty() || patterns.is_empty()) {
            let message = format!("body `{name}` needs a name and at least one pattern");
            return Err(at("bodies", message).help("for example: bodies.wheel = [\"wheel:*\"]"));
        }
    }
    match (settings.path.is_some() || settings.paths.is_some(), settings.scene.is_some()) {
        (true, true) => {
            let both = at("scene", "a recording is either a `path` or a `scene`, not both".into());
            return Err(both.help("take one of them out"));
        }
        (true, false) => {
            if let Some(key) = idle(&["seed", "noise", "frames"]) {
                let error = at(key, format!("`{key}` is for a `scene`, but the recording is a file"));
                return Err(error.help(format!("take `{key}` out, or name a `scene` instead of `path`")));
            }
        }
        (false, true) => {
            if let Some(key) = idle(&["format", "unit", "bodies"]) {
                let error = at(key, format!("`{key}` is for a file, but the recording is a scene"));
                return Err(error.help(format!("take `{key}` out, or name a `path` instead of `scene`")));
            }
        }
        (false, false) => {}
    }
    if settings.world.as_ref().is_some_and(|name| name.trim().is_empty()) {
        return Err(at("world", "the world needs a name, found none".into()).help("for example: world = \"world\""));
    }
    Ok(())
}

/// Refuses a grid that ends before it begins or never seems to end, settings of another search than the one chosen, and
/// models that know no standard error.
fn check_scale(
    settings: &ScaleSettings,
    models: &[NamedModel],
    spans: &[(String, Range<usize>)],
) -> Result<(), SettingsError> {
    /// Scales that every model can be asked about in a time that anyone waits for.
    const MOST: usize = 10_000;
    let place = |key: &str| spans.iter().find(|(name, _)| name == key).map_or(0..0, |(_, span)| span.clone());
    let chosen = settings.search;
    let of_another = |key: &str| {
        let all = [ScaleSearch::Grid, ScaleSearch::Moments, ScaleSearch::ClosedForm].into_iter();
        let others: Vec<String> =
            all.filter(|one| one.keys().contains(&key)).map(|one| format!("\"{}\"", one.word())).collect();
        (!others.is_empty() && !chosen.keys().contains(&key)).then(|| others.join(" or "))
    };
    if let Some((key, span, others)) = spans.iter().find_map(|(key, span)| Some((key, span, of_another(key)?))) {
        let chosen = chosen.word();
        let message = format!("`{key}` is for the search {others}, but the search is \"{chosen}\"");
        let help = format!("take `{key}` out, or write search = {others} under [scale]");
        return Err(SettingsError::at(span.clone(), message).help(help));
    }
    let scales = if chosen.tries_scales() { settings.factors().len() } else { 0 };
    if scales > MOST {
        let message = format!("the grid has {scales} scales, more than {MOST}");
        let key = ["step", "to", "from"].into_iter().find(|key| spans.iter().any(|(name, _)| name == key));
        let help = "write a larger `step`, or bring `from` and `to` nearer to each other";
        return Err(SettingsError::at(place(key.unwrap_or("")), message).help(help));
    }
    if chosen.tries_scales() && settings.to < settings.from {
        let message = format!("`to`: {} is less than `from`, {}", settings.to, settings.from);
        return Err(SettingsError::at(place("to"), message).help("for example: from = 0.5, to = 1.5"));
    }
    let silent = models.iter().find(|model| !model.model.states_evidence());
    if let Some(silent) = silent.filter(|_| settings.search == ScaleSearch::ClosedForm) {
        let message = format!(
            "the search \"closed-form\" fits the scale by evidence, and the model `{}` (kind `{}`) states none",
            silent.name, silent.kind
        );
        let help = "write search = \"grid\" under [scale], or choose models that state evidence, such as `revolute`";
        return Err(SettingsError::at(place("search"), message).help(help));
    }
    Ok(())
}

/// Refuses settings of another rule than the one chosen, rather than ignoring them.
fn check_scoring(settings: &ScoringSettings, spans: &[(String, Range<usize>)]) -> Result<(), SettingsError> {
    let chosen = settings.rule;
    let all = [RuleKind::Likelihood, RuleKind::Cascade, RuleKind::Expressions];
    let of_another = |key: &str| {
        let another = all.into_iter().find(|rule| rule.keys().contains(&key));
        another.filter(|_| !chosen.keys().contains(&key))
    };
    match spans.iter().find_map(|(key, span)| Some((key, span, of_another(key)?))) {
        Some((key, span, other)) => {
            let (other, chosen) = (other.word(), chosen.word());
            let message = format!("`{key}` is for the rule \"{other}\", but the rule is \"{chosen}\"");
            let help = format!("take `{key}` out, or write rule = \"{other}\" under [scoring]");
            Err(SettingsError::at(span.clone(), message).help(help))
        }
        None => Ok(()),
    }
}

/// The rule of settings over models.
pub(crate) fn rule(scoring: &ScoringSettings, models: &[NamedModel]) -> Result<Rule, RuleError> {
    if scoring.rule == RuleKind::Likelihood
        && let Some(silent) = models.iter().find(|model| !model.model.states_evidence())
    {
        let message = format!(
            "the rule \"likelihood\" compares evidence, and the model `{}` (kind `{}`) states none",
            silent.name, silent.kind
        );
        let help = "write rule = \"cascade\" or rule = \"expressions\" under [scoring], or choose models that state \
                    evidence, such as `revolute`";
        return Err(RuleError::new("rule", message, help));
    }
    let announced = models.iter().map(|NamedModel { name, model, .. }| Announcement {
        name,
        parts: model.parts(),
        states_evidence: model.states_evidence(),
    });
    Rule::new(scoring, &announced.collect::<Vec<_>>())
}

/// The first letter of a text, where no better place is known.
pub(crate) fn beginning(text: &str) -> Range<usize> {
    0..text.chars().next().map_or(0, char::len_utf8)
}

fn parse_table(text: &str) -> Result<DeTable<'_>, SettingsError> {
    let parsed = DeTable::parse(text).map_err(|error| {
        SettingsError::at(error.span().unwrap_or(beginning(text)), format!("this is not TOML: {}", error.message()))
    })?;
    Ok(parsed.into_inner())
}

/// Takes a table out of the configuration and reads it; one that is missing has its defaults.
fn table<T: serde::de::DeserializeOwned + JsonSchema + Default>(
    root: &mut DeTable<'_>,
    name: &str,
) -> Result<T, SettingsError> {
    root.remove(name).map_or_else(|| Ok(T::default()), settings::read)
}

/// Where the keys of a table are, the table itself first.
fn key_spans(value: Option<&Value<'_>>) -> Vec<(String, Range<usize>)> {
    let Some(value) = value else { return Vec::new() };
    let keys = value.as_ref().as_table().into_iter().flatten();
    let keys = keys.map(|(key, value)| (key.as_ref().to_string(), value.span()));
    [(String::new(), value.span())].into_iter().chain(keys).collect()
}

fn named_models(models: Value<'_>, catalog: &Catalog) -> Result<Vec<NamedModel>, SettingsError> {
    let span = models.span();
    let DeValue::Table(models) = models.into_inner() else {
        return Err(SettingsError::at(span, "`models` must be tables, one per model").help("write [models.NAME]"));
    };
    if models.is_empty() {
        let help = "add [models.NAME], or leave [models] out for the default models";
        return Err(SettingsError::at(span, "`models` has no model").help(help));
    }
    models.into_iter().map(|(name, settings)| named_model(name, settings, catalog)).collect()
}

fn named_model<'i>(
    name: Spanned<std::borrow::Cow<'i, str>>,
    value: Value<'i>,
    catalog: &Catalog,
) -> Result<NamedModel, SettingsError> {
    let span = value.span();
    let DeValue::Table(mut table) = value.into_inner() else {
        let message = format!("the model `{}` must be a table of its settings", name.as_ref());
        return Err(SettingsError::at(span, message).help(format!("write [models.{}]", name.as_ref())));
    };
    let (kind, kind_span) = match table.remove("kind") {
        None => (name.as_ref().to_string(), name.span()),
        Some(kind) => match kind.as_ref().as_str() {
            Some(word) => (word.to_owned(), kind.span()),
            None => return Err(SettingsError::at(kind.span(), "`kind` must be the name of a joint model, in quotes")),
        },
    };
    let Some(plugin) = catalog.get(&kind) else {
        let mut error = settings::unknown("joint model", &kind, kind_span, &catalog.names().collect::<Vec<_>>());
        error.help = error.help.map(|known| {
            format!(
                "{known}\na model of another crate must be linked: `use that_crate as _;` in the program's main file"
            )
        });
        return Err(error);
    };
    let model = Arc::from(plugin.build(Spanned::new(span, DeValue::Table(table)))?);
    Ok(NamedModel { name: name.into_inner().into_owned(), kind, model })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Configuration, SettingsError> {
        Configuration::parse(text, &Catalog::linked().expect("unique names"))
    }

    /// The error's message, its help, and the text it points at.
    fn refused(text: &str) -> (String, String, &str) {
        let error = parse(text).expect_err("refused");
        (error.message, error.help.unwrap_or_default(), &text[error.span])
    }

    #[test]
    fn an_empty_configuration_means_all_lower_pairs_by_likelihood() {
        let configuration = parse("").expect("valid");
        let names: Vec<_> = configuration.models.iter().map(|m| (m.name.as_str(), m.kind.as_str())).collect();
        let own =
            ["cylindrical", "planar", "prismatic", "revolute", "rigid", "screw", "spherical"].map(|name| (name, name));
        let mut expected = [own.as_slice(), &[("disconnected", "free")]].concat();
        expected.sort_unstable();
        assert_eq!(names, expected);
        assert!(configuration.models.iter().all(|named| named.model.states_evidence()));
        assert!(matches!(configuration.rule, Rule::Likelihood(_)));
        assert_eq!(configuration.motion, MotionSettings::default());
    }

    #[test]
    fn unknown_names_point_at_themselves_with_the_nearest_spelling() {
        let (message, help, at) = refused("[recordng]\npath = 'x'");
        assert_eq!((message.as_str(), at), ("unknown table `recordng`", "recordng"));
        assert!(help.contains("did you mean `recording`?"), "{help}");
        let (message, help, at) = refused("[motion]\nregistraton = 'shape'");
        assert_eq!((message.as_str(), at), ("unknown key `registraton`", "registraton"));
        assert!(help.contains("`registration`") && help.contains("`pose_radius`"), "{help}");
        let (message, help, at) = refused("[models.rigid]\nkind = 'thesis-rigit'");
        assert_eq!((message.as_str(), at), ("unknown joint model `thesis-rigit`", "'thesis-rigit'"));
        assert!(help.contains("did you mean `thesis-rigid`?") && help.contains("use that_crate as _;"), "{help}");
        let (message, _, at) = refused("[models.hinge]");
        assert_eq!((message.as_str(), at), ("unknown joint model `hinge`", "hinge"));
        let (message, _, at) = refused("[models.revolute]\nkind = 'thesis-revolute'\ncircle_tolerence = 0.1");
        assert_eq!((message.as_str(), at), ("unknown key `circle_tolerence`", "circle_tolerence"));
    }

    #[test]
    fn wrong_types_words_and_ranges_point_at_the_value() {
        for (text, message, at) in [
            ("[motion]\nregistration = 'shap'", "`registration`: unknown value `shap`", "'shap'"),
            ("[motion]\nregistration = 3", "`registration`: expected text in quotes, found the number 3", "3"),
            ("[motion]\npose_radius = 'x'", "`pose_radius`: expected a number, found the text \"x\"", "'x'"),
            ("[motion]\npose_radius = -1", "`pose_radius`: -1 is out of range", "-1"),
            ("[motion]\npose_radius = nan", "`pose_radius`: NaN is out of range", "nan"),
            ("[motion]\nnoise = -0.1", "`noise`: -0.1 is out of range", "-0.1"),
            ("[motion]\nnoise = 'estimat'", "`noise`: unknown value `estimat`", "'estimat'"),
            ("[recording]\npairs = [['a']]", "`pairs`: a pair has two names, found 1", "['a']"),
            (
                "[recording]\npairs = [['a', 'b'], ['a', 'b', 'c']]",
                "`pairs`: a pair has two names, found 3",
                "['a', 'b', 'c']",
            ),
            ("[recording]\npairs = [['a', 'a']]", "the pair [`a`, `a`] names one body twice", "'a'"),
            (
                "[recording]\npairs = [['a', 'b'], ['b', 'a'], ['a', 'b']]",
                "the pair [`a`, `b`] is there twice",
                "['a', 'b']",
            ),
            ("[motion]\ndepth_gain = true", "`depth_gain`: expected a word or a number, found true", "true"),
            (
                "[scale]\nsearch = 'grid'\nspread = 0.3",
                "`spread` is for the search \"closed-form\", but the search is \"grid\"",
                "0.3",
            ),
            (
                "[scale]\nsearch = 'closed-form'\nfrom = 0.3",
                "`from` is for the search \"grid\" or \"moments\", but the search is \"closed-form\"",
                "0.3",
            ),
            (
                "[scale]\nbody = 'reference'",
                "`body` is for the search \"grid\" or \"moments\", but the search is \"none\"",
                "'reference'",
            ),
            (
                "[scale]\nsearch = 'grid'\nfrom = 0.05\nto = 20\nstep = 0.0001",
                "the grid has 199501 scales, more than 10000",
                "0.0001",
            ),
            ("[recording]\nseed = 1.5", "`seed`: expected a whole number, found the number 1.5", "1.5"),
            ("[models]\nrigid = 1", "the model `rigid` must be a table of its settings", "1"),
            ("[models.p]\nkind = 'thesis-prismatic'\nsections = 0", "`sections`: 0 is out of range", "0"),
            (
                "[scoring]\nrule = 'cascade'\norder = ['rigid', 'hinge']",
                "the cascade's order names `hinge`, which is not among the models",
                "['rigid', 'hinge']",
            ),
            ("[scoring]\nmargin = 0.9", "`margin` is for the rule \"cascade\", but the rule is \"likelihood\"", "0.9"),
            (
                "[scoring]\nrule = 'cascade'\nlead = 3.0",
                "`lead` is for the rule \"likelihood\", but the rule is \"cascade\"",
                "3.0",
            ),
            ("[scoring]\nrule = 'likelihod'", "`rule`: unknown value `likelihod`", "'likelihod'"),
            ("[recording]\npath = 'a'\nscene = 'b'", "a recording is either a `path` or a `scene`, not both", "'b'"),
            ("[recording]\npath = 'a'\nseed = 7", "`seed` is for a `scene`, but the recording is a file", "7"),
            ("[recording]\nscene = 'a'\nunit = 'm'", "`unit` is for a file, but the recording is a scene", "'m'"),
            ("[recording]\nframes = 1", "`frames`: 1 is out of range", "1"),
            ("[recording]\nworld = ' '", "the world needs a name, found none", "' '"),
            ("[models]", "`models` has no model", "[models]"),
        ] {
            let (found, _, place) = refused(text);
            assert_eq!((found.as_str(), place), (message, at), "{text}");
        }
        let (message, _, _) = refused("[motion\n");
        assert!(message.starts_with("this is not TOML"), "{message}");
    }

    #[test]
    fn a_catalog_without_the_default_models_is_refused_without_a_place() {
        let error = Configuration::parse("", &Catalog::of([]).expect("no names")).expect_err("refused");
        assert_eq!((error.message.as_str(), error.span), ("unknown joint model `cylindrical`", 0..0));
    }

    #[test]
    fn play_is_read_from_a_share_a_length_a_table_or_a_word() {
        use jointscope_motion::Play;
        let play = |text: &str| parse(&format!("motion.play = {text}")).expect("valid").motion.play;
        let usual = Play::default();
        for (text, travel) in [("'0.7 %'", 0.007), ("' 1.5%'", 0.015), ("'0 %'", 0.0), ("'100 %'", 1.0)] {
            let found = play(text);
            assert!((found.travel - travel).abs() < 1e-15, "{text}: {}", found.travel);
            assert_eq!(Play { travel: usual.travel, ..found }, usual);
        }
        assert_eq!(play("0.002"), Play { travel: 0.0, distance: 0.002, ..usual });
        assert_eq!(play("{ travel = 0.01, turn = 0.002 }"), Play { travel: 0.01, turn: 0.002, ..usual });
        assert_eq!([play("'none'"), play("0"), play("0.0")], [Play::NONE; 3]);
        assert_eq!(play("{}"), usual);
    }

    #[test]
    fn words_and_numbers_both_set_the_noise() {
        use jointscope_motion::NoiseSetting;
        assert_eq!(parse("motion.noise = 0.002").expect("valid").motion.noise, NoiseSetting::Known(0.002));
        assert_eq!(parse("motion.noise = 'estimate'").expect("valid").motion.noise, NoiseSetting::Estimate);
    }
}
