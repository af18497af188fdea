//! What the terminal can show.

use std::io::{IsTerminal, stdout};

use jointscope_report::Style;

/// How results are printed: plain into files and pipes; on a terminal within its width, and in colours unless `NO_COLOR`
/// is set or it knows none.
pub(crate) fn style() -> Style {
    let shown = stdout().is_terminal();
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb");
    let width = comfy_table::Table::new().width().map(usize::from);
    Style { width: width.filter(|_| shown), colour: shown && !set("NO_COLOR") && !dumb }
}
