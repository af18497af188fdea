//! What went wrong, for a person to read, and the exit code for a program.

use std::{
    fmt,
    io::{self, ErrorKind, IsTerminal, Write},
    ops::Range,
    path::Path,
    process::ExitCode,
};

use jointscope_detection::SettingsError;
use jointscope_report::printable;
use miette::{
    Diagnostic, LabeledSpan, MietteError, MietteHandlerOpts, MietteSpanContents, NamedSource, Report, SourceCode,
    SourceSpan, SpanContents, miette,
};

/// A failure, by whose fault it is.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The data could not be read or processed: exit code 1.
    Data(Report),
    /// Wrong usage or configuration: exit code 2.
    Usage(Report),
    /// Nobody reads the output any more: quiet.
    Unread,
}

impl Failure {
    pub(crate) fn data(error: impl fmt::Display) -> Self {
        Self::Data(report(error, None))
    }

    pub(crate) fn data_with_help(error: impl fmt::Display, help: &str) -> Self {
        Self::Data(report(error, Some(help)))
    }

    pub(crate) fn usage(error: impl fmt::Display) -> Self {
        Self::Usage(report(error, None))
    }

    pub(crate) fn usage_with_help(error: impl fmt::Display, help: &str) -> Self {
        Self::Usage(report(error, Some(help)))
    }

    /// A configuration error, shown in the user's text.
    pub(crate) fn configuration(path: &Path, text: &str, mut error: SettingsError) -> Self {
        let source = NamedSource::new(printable(&path.display().to_string()), text.to_owned());
        error.message = in_lines(&error.message);
        error.help = error.help.as_deref().map(in_lines);
        let (window, label) = match window(text, &error.span) {
            Some(window) => {
                error.span.end = error.span.end.min(window.end);
                (Some(window), "here, in a line too long to be shown")
            }
            None => (None, "here"),
        };
        Self::Usage(Report::new(InConfiguration { source, error, window, label }))
    }

    /// A file or folder that could not be written.
    pub(crate) fn unwritten(path: &Path, error: &io::Error) -> Self {
        let advice = match error.kind() {
            ErrorKind::AlreadyExists | ErrorKind::NotADirectory => {
                "a file is where a folder is needed: name another folder"
            }
            ErrorKind::IsADirectory => "a folder has this name: name a file",
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "check the permissions of the folder",
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "make room on the disk",
            _ => "check the path and the disk it is on",
        };
        // What follows is the name of a temporary file, of which the user knows nothing.
        let cause = error.to_string();
        let cause = cause.split(" at path ").next().unwrap_or(&cause);
        Self::data(format!("{}: cannot be written: {cause}; {advice}", path.display()))
    }

    /// Tells the user, and gives the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let (report, code) = match self {
            Self::Data(report) => (report, 1),
            Self::Usage(report) => (report, 2),
            Self::Unread => return ExitCode::SUCCESS,
        };
        // Where nobody reads the errors either, the exit code says it.
        let _ = writeln!(io::stderr(), "{report:?}");
        ExitCode::from(code)
    }
}

/// Sets how errors are shown: wrapped only where there is a terminal, so that programs find whole lines.
pub(crate) fn set_style() {
    let terminal = io::stderr().is_terminal();
    // Fails if somebody else, such as a program with this one inside, has set a style before; that one is kept.
    let _ = miette::set_hook(Box::new(move |_| {
        Box::new(MietteHandlerOpts::new().wrap_lines(terminal).break_words(false).build())
    }));
}

fn report(error: impl fmt::Display, help: Option<&str>) -> Report {
    let message = in_lines(&error.to_string());
    match help {
        Some(help) => miette!(help = in_lines(help), "{message}"),
        None => miette!("{message}"),
    }
}

/// A text that may quote names from files, as a terminal can show it; line breaks stay.
fn in_lines(text: &str) -> String {
    text.split('\n').map(printable).collect::<Vec<_>>().join("\n")
}

/// The part of a long line that is shown around a place in it; `None` where whole lines are.
fn window(text: &str, span: &Range<usize>) -> Option<Range<usize>> {
    /// Bytes of a line, of which whole ones are shown; and of a window before and behind the place's beginning.
    const LONG: usize = 400;
    const BEFORE: usize = 60;
    const BEHIND: usize = 100;
    let boundary = |at: usize| (0..=at.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
    let at = boundary(span.start);
    let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    let end = text[at..].find('\n').map_or(text.len(), |end| at + end);
    let before = text[..start].trim_end_matches('\n').rfind('\n').map_or(0, |end| end + 1);
    let behind = text.get(end + 1..).and_then(|rest| rest.find('\n')).map_or(text.len(), |length| end + 1 + length);
    let long = end - start > LONG || start - before > LONG || behind - end > LONG;
    let from = boundary(at.saturating_sub(BEFORE)).max(start);
    let to = boundary(at + BEHIND).min(end);
    long.then_some(from..to)
}

/// A configuration error with the text it is in.
#[derive(Debug)]
struct InConfiguration {
    source: NamedSource<String>,
    error: SettingsError,
    /// What of the text is shown, where lines are too long.
    window: Option<Range<usize>>,
    label: &'static str,
}

impl SourceCode for InConfiguration {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        behind: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        // Without lines about it, only the place is asked for.
        let Some(window) = self.window.clone().filter(|_| before + behind > 0) else {
            return self.source.read_span(span, before, behind);
        };
        let shown = self.source.read_span(&(window.start, window.len()).into(), 0, 0)?;
        let name = shown.name().unwrap_or_default().to_owned();
        let (line, column, lines) = (shown.line(), shown.column(), shown.line_count());
        Ok(Box::new(MietteSpanContents::new_named(name, shown.data(), *shown.span(), line, column, lines)))
    }
}

impl fmt::Display for InConfiguration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for InConfiguration {}

impl Diagnostic for InConfiguration {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.error.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(self)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new([LabeledSpan::new_with_span(Some(self.label.into()), self.error.span.clone())].into_iter()))
    }
}
