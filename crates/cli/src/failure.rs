//! What went wrong, for a person to read, and the exit code for a program.

use std::{fmt, io, path::Path, process::ExitCode};

use jointscope_detection::SettingsError;
use miette::{Diagnostic, LabeledSpan, NamedSource, Report, miette};

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
        Self::Data(miette!("{error}"))
    }

    pub(crate) fn usage(error: impl fmt::Display) -> Self {
        Self::Usage(miette!("{error}"))
    }

    pub(crate) fn usage_with_help(error: impl fmt::Display, help: impl fmt::Display) -> Self {
        Self::Usage(miette!(help = help.to_string(), "{error}"))
    }

    /// A configuration error, shown in the user's text.
    pub(crate) fn configuration(path: &Path, text: &str, error: SettingsError) -> Self {
        let source = NamedSource::new(path.display().to_string(), text.to_owned());
        Self::Usage(Report::new(InConfiguration { source, error }))
    }

    /// A file that could not be written.
    pub(crate) fn unwritten(path: &Path, error: &io::Error) -> Self {
        Self::data(format!("{}: cannot be written: {error}", path.display()))
    }

    pub(crate) fn report(self) -> ExitCode {
        match self {
            Self::Data(report) => {
                eprintln!("{report:?}");
                ExitCode::from(1)
            }
            Self::Usage(report) => {
                eprintln!("{report:?}");
                ExitCode::from(2)
            }
            Self::Unread => ExitCode::SUCCESS,
        }
    }
}

/// A configuration error with the text it is in.
#[derive(Debug)]
struct InConfiguration {
    source: NamedSource<String>,
    error: SettingsError,
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
        Some(&self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new([LabeledSpan::new_with_span(Some("here".into()), self.error.span.clone())].into_iter()))
    }
}
