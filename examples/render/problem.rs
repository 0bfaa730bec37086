//! What stops the program, and its exit code.

use std::fmt;
use std::process::ExitCode;

/// A message, what to do about it, and whose fault it is.
#[derive(Debug)]
pub struct Problem {
    message: String,
    hint: Option<String>,
    code: u8,
}

impl Problem {
    /// Unusable options or input.
    pub fn input(message: impl fmt::Display) -> Self {
        Self { message: message.to_string(), hint: None, code: 2 }
    }

    /// Trouble with the device or with writing.
    pub fn trouble(message: impl fmt::Display) -> Self {
        Self { message: message.to_string(), hint: None, code: 1 }
    }

    pub fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        match &self.hint {
            Some(hint) => write!(f, "\n  hint: {hint}"),
            None => Ok(()),
        }
    }
}

impl From<progressive_iso::Error> for Problem {
    fn from(error: progressive_iso::Error) -> Self {
        use progressive_iso::Error;
        match &error {
            Error::Device(_)
            | Error::DeviceLost
            | Error::OutOfMemory { .. }
            | Error::ShaderRefused { .. }
            | Error::Refused { .. }
            | Error::MapFailed
            | Error::NotRun
            | Error::Stalled { .. }
            | Error::UnsupportedDevice { .. } => Self::trouble(&error),
            Error::BudgetTooSmall { minimum, .. } => {
                let least = minimum.div_ceil(1 << 20);
                Self::input(&error).hint(format!("--budget {least} is the least for this scene"))
            }
            Error::Wavefront(_) => {
                Self::input(&error).hint("see --size, --eye, --target and --spacing")
            }
            _ => Self::input(&error),
        }
    }
}

impl From<volume_io::Error> for Problem {
    fn from(error: volume_io::Error) -> Self {
        use volume_io::Error;
        let hint = match &error {
            Error::Io { .. } => {
                "give a file that can be read, `brain`, or a generator such as gyroid:128x128x128"
            }
            Error::UnknownFormat { .. } | Error::HeaderlessNeedsLayout { .. } => {
                "for a zfp stream without a header add --dims X,Y,Z --rate R, for raw samples --type T"
            }
            Error::NonFinite { .. } => "--replace-nan V reads it anyway",
            Error::SeveralVolumes { .. } | Error::TimeIndex { .. } => "choose with --time-index N",
            Error::LengthMismatch { .. } => "check --dims and --rate",
            Error::RawNeedsLayout { .. } => "add --dims X,Y,Z --type T",
            Error::RawLength { .. } => "check --dims and --type",
            Error::NoSuchArray { .. } => "choose with --array NAME",
            Error::Rate { .. } => "see --rate",
            _ => return Self::input(&error),
        };
        Self::input(&error).hint(hint)
    }
}
