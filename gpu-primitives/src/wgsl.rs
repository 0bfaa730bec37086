//! Puts a shader together from named modules, so that kernels share code without copying it.
//!
//! The texts are plain WGSL with a few lines that start with `#`:
//!
//! - `#import name` emits the module `name`, once, before the importing text;
//! - `#ifdef NAME`, `#ifndef NAME`, `#else`, `#endif` choose lines. A name is defined when it is
//!   among the constants and is not `Bool(false)`.
//!
//! Every constant becomes a `const` at the top of the composed text.

use std::fmt::Write as _;

/// A named piece of WGSL that other modules import: structs and functions only, one name prefix,
/// no `@group` declarations.
#[derive(Clone, Copy, Debug)]
pub struct Module {
    /// Name that `#import` lines use.
    pub name: &'static str,
    /// WGSL text with `#` lines.
    pub source: &'static str,
}

/// Value of a `const` injected at the top of the composed text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constant {
    /// A WGSL `u32`.
    U32(u32),
    /// A WGSL `i32`.
    I32(i32),
    /// A WGSL `f32`; must be finite.
    F32(f32),
    /// A WGSL `bool`; `false` counts as not defined in `#ifdef`.
    Bool(bool),
}

/// A complete WGSL text and where each of its lines comes from.
#[derive(Debug, Clone)]
pub struct Composed {
    /// The text to hand to wgpu.
    pub source: String,
    /// Origin of every line of `source`; `None` for lines that were not in a module.
    lines: Vec<Option<(&'static str, usize)>>,
}

impl Composed {
    /// Module and line of `line`, a line of [`Composed::source`]; both lines count from 1.
    /// `None` outside the text and for injected lines.
    #[must_use]
    pub fn origin(&self, line: usize) -> Option<(&str, usize)> {
        self.lines.get(line.checked_sub(1)?).copied().flatten()
    }

    fn push(&mut self, text: &str, origin: Option<(&'static str, usize)>) {
        self.source.push_str(text);
        self.source.push('\n');
        self.lines.push(origin);
    }
}

/// Why a text could not be composed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ComposeError {
    /// An `#import` names a module that is not in the library.
    #[error("{module}:{line}: import of \"{import}\", which is not in the library")]
    UnknownImport {
        /// Module with the `#import` line.
        module: &'static str,
        /// Line of the `#import`, from 1.
        line: usize,
        /// Name that was not found.
        import: String,
    },
    /// Two different texts in the library have the imported name.
    #[error("{module}:{line}: the library holds different modules named \"{import}\"")]
    AmbiguousImport {
        /// Module with the `#import` line.
        module: &'static str,
        /// Line of the `#import`, from 1.
        line: usize,
        /// Name that was found more than once.
        import: String,
    },
    /// A module imports itself, directly or through others.
    #[error("import cycle: {}", chain.join(" -> "))]
    ImportCycle {
        /// Modules from the first to its repetition.
        chain: Vec<&'static str>,
    },
    /// An `#else` or `#endif` without its `#ifdef`, a second `#else`, or an `#ifdef` left open.
    #[error("{module}:{line}: {directive} does not pair up")]
    Unbalanced {
        /// Module with the line.
        module: &'static str,
        /// Line of the directive, from 1.
        line: usize,
        /// The directive that has no partner.
        directive: &'static str,
    },
    /// A line starts with `#` but is none of the known directives, or its name is missing or odd.
    #[error("{module}:{line}: unknown directive \"{text}\"")]
    UnknownDirective {
        /// Module with the line.
        module: &'static str,
        /// Line, from 1.
        line: usize,
        /// The line itself.
        text: String,
    },
    /// A constant's name is not a WGSL identifier, appears twice, or its value is not finite.
    #[error("constant \"{name}\": {reason}")]
    Constant {
        /// Name of the constant.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
}

/// Puts `entry`, the modules that it imports and the constants together.
///
/// Extensions (`enable`, `requires`, `diagnostic`) move to the top, where WGSL wants them.
///
/// # Errors
/// See [`ComposeError`]; the texts are not parsed as WGSL, which is left to wgpu.
pub fn compose(
    entry: Module,
    library: &[Module],
    constants: &[(&str, Constant)],
) -> Result<Composed, ComposeError> {
    let mut composer =
        Composer { library, constants, active: Vec::new(), done: Vec::new(), parts: Vec::new() };
    let injected = declarations(constants)?;
    composer.module(entry)?;

    let mut composed = Composed { source: String::new(), lines: Vec::new() };
    let (header, body): (Vec<Line>, Vec<Line>) =
        composer.parts.into_iter().partition(|line| is_extension(line.text));
    for line in header {
        composed.push(line.text, Some((line.module, line.number)));
    }
    for declaration in injected {
        composed.push(&declaration, None);
    }
    for line in body {
        composed.push(line.text, Some((line.module, line.number)));
    }
    Ok(composed)
}

/// [`compose`] for texts and constants that are fixed at compile time and that tests compose.
///
/// An error becomes the composed text, so that it is reported the way every other fault of a
/// shader is: by wgpu, when the pipeline is made.
#[must_use]
pub fn compose_fixed(
    entry: Module,
    library: &[Module],
    constants: &[(&str, Constant)],
) -> Composed {
    compose(entry, library, constants).unwrap_or_else(|error| {
        tracing::error!(%error, module = entry.name, "shader text does not compose");
        Composed { source: format!("compose_error: {error}\n"), lines: vec![None] }
    })
}

struct Line {
    module: &'static str,
    number: usize,
    text: &'static str,
}

struct Composer<'a> {
    library: &'a [Module],
    constants: &'a [(&'a str, Constant)],
    /// Modules whose text is being read, outermost first.
    active: Vec<&'static str>,
    done: Vec<&'static str>,
    parts: Vec<Line>,
}

/// An open `#ifdef`.
struct Branch {
    line: usize,
    directive: &'static str,
    outer: bool,
    condition: bool,
    in_else: bool,
}

impl Branch {
    fn taken(&self) -> bool {
        self.outer && (self.condition != self.in_else)
    }
}

impl Composer<'_> {
    fn module(&mut self, module: Module) -> Result<(), ComposeError> {
        if self.done.contains(&module.name) {
            return Ok(());
        }
        if let Some(first) = self.active.iter().position(|&name| name == module.name) {
            let mut chain = self.active.split_off(first);
            chain.push(module.name);
            return Err(ComposeError::ImportCycle { chain });
        }
        self.active.push(module.name);
        let own = self.lines(module)?;
        self.parts.extend(own);
        self.active.pop();
        self.done.push(module.name);
        Ok(())
    }

    /// The module's chosen lines; what it imports is emitted on the way.
    fn lines(&mut self, module: Module) -> Result<Vec<Line>, ComposeError> {
        let mut own = Vec::new();
        let mut branches: Vec<Branch> = Vec::new();
        for (index, text) in module.source.lines().enumerate() {
            let line = Line { module: module.name, number: index + 1, text };
            let taken = branches.last().is_none_or(Branch::taken);
            let Some(directive) = text.trim_start().strip_prefix('#') else {
                if taken {
                    own.push(line);
                }
                continue;
            };
            match words(directive).as_slice() {
                ["import", name] if taken => self.import(&line, name)?,
                ["import", _] => {}
                ["ifdef", name] => branches.push(Branch {
                    line: line.number,
                    directive: "#ifdef",
                    outer: taken,
                    condition: self.defined(name),
                    in_else: false,
                }),
                ["ifndef", name] => branches.push(Branch {
                    line: line.number,
                    directive: "#ifndef",
                    outer: taken,
                    condition: !self.defined(name),
                    in_else: false,
                }),
                ["else"] => match branches.last_mut() {
                    Some(branch) if !branch.in_else => branch.in_else = true,
                    _ => return Err(line.unbalanced("#else")),
                },
                ["endif"] => {
                    branches.pop().ok_or_else(|| line.unbalanced("#endif"))?;
                }
                _ => {
                    return Err(ComposeError::UnknownDirective {
                        module: line.module,
                        line: line.number,
                        text: text.trim().to_owned(),
                    });
                }
            }
        }
        match branches.pop() {
            None => Ok(own),
            Some(open) => Err(ComposeError::Unbalanced {
                module: module.name,
                line: open.line,
                directive: open.directive,
            }),
        }
    }

    fn import(&mut self, line: &Line, name: &str) -> Result<(), ComposeError> {
        let mut found = self.library.iter().filter(|module| module.name == name);
        let (module, number, import) = (line.module, line.number, name.to_owned());
        let Some(first) = found.next().copied() else {
            return Err(ComposeError::UnknownImport { module, line: number, import });
        };
        // Libraries of several crates may list the same module; two texts must not share a name.
        if found.any(|other| other.source != first.source) {
            return Err(ComposeError::AmbiguousImport { module, line: number, import });
        }
        self.module(first)
    }

    fn defined(&self, name: &str) -> bool {
        self.constants.iter().any(|&(known, value)| known == name && value != Constant::Bool(false))
    }
}

impl Line {
    fn unbalanced(&self, directive: &'static str) -> ComposeError {
        ComposeError::Unbalanced { module: self.module, line: self.number, directive }
    }
}

/// The words of a directive, without a trailing comment.
fn words(directive: &str) -> Vec<&str> {
    let text = directive.split_once("//").map_or(directive, |(before, _)| before);
    text.split_whitespace().collect()
}

fn is_extension(text: &str) -> bool {
    let text = text.trim_start();
    ["enable ", "requires ", "diagnostic(", "diagnostic ("]
        .iter()
        .any(|start| text.starts_with(start))
}

fn declarations(constants: &[(&str, Constant)]) -> Result<Vec<String>, ComposeError> {
    let mut out = Vec::with_capacity(constants.len());
    for (index, &(name, value)) in constants.iter().enumerate() {
        let error = |reason| ComposeError::Constant { name: name.to_owned(), reason };
        if !is_identifier(name) {
            return Err(error("not a WGSL identifier"));
        }
        if constants[..index].iter().any(|&(other, _)| other == name) {
            return Err(error("given twice"));
        }
        out.push(declaration(name, value).ok_or_else(|| error("not finite"))?);
    }
    Ok(out)
}

/// `None` when the value has no literal.
fn declaration(name: &str, value: Constant) -> Option<String> {
    let mut text = format!("const {name}: ");
    let written = match value {
        Constant::U32(value) => write!(text, "u32 = {value}u;"),
        // Without a suffix: the least i32 has no suffixed literal.
        Constant::I32(value) => write!(text, "i32 = {value};"),
        Constant::F32(value) if value.is_finite() => write!(text, "f32 = {value:?}f;"),
        Constant::F32(_) => return None,
        Constant::Bool(value) => write!(text, "bool = {value};"),
    };
    written.ok().map(|()| text)
}

fn is_identifier(name: &str) -> bool {
    let mut bytes = name.bytes();
    bytes.next().is_some_and(|first| first.is_ascii_alphabetic() || first == b'_')
        && bytes.all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
        && name != "_"
        && !name.starts_with("__")
}
