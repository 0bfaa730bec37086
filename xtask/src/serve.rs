//! A web server for one folder, on this computer only.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Component, Path, PathBuf};

/// Listens until the program ends.
#[derive(Debug)]
pub(crate) struct Server {
    listener: TcpListener,
    folder: PathBuf,
}

impl Server {
    /// Port 0: any that is free.
    pub(crate) fn bind(folder: &Path, port: u16) -> Result<Self, String> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .map_err(|error| format!("port {port}: {error}"))?;
        Ok(Self { listener, folder: folder.to_owned() })
    }

    pub(crate) fn port(&self) -> u16 {
        self.listener.local_addr().map_or(0, |address| address.port())
    }

    /// Answers every request on a thread of its own.
    pub(crate) fn run(&self) {
        std::thread::scope(|scope| {
            for stream in self.listener.incoming().flatten() {
                // A visitor who goes away is no fault.
                scope.spawn(move || drop(self.answer(stream)));
            }
        });
    }

    fn answer(&self, mut stream: TcpStream) -> std::io::Result<()> {
        let mut line = String::new();
        let mut lines = BufReader::new(stream.try_clone()?);
        lines.read_line(&mut line)?;
        // The headers say nothing that matters here, but must be read.
        let mut header = String::new();
        while lines.read_line(&mut header)? > 2 {
            header.clear();
        }
        let file = path(&line).map(|path| self.folder.join(path));
        let (status, kind, body) =
            match file.and_then(|file| Some((kind(&file), std::fs::read(&file).ok()?))) {
                Some((kind, body)) => ("200 OK", kind, body),
                None => ("404 Not Found", "text/plain", b"not found\n".to_vec()),
            };
        write!(
            stream,
            "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\
             Cache-Control: no-cache\r\nConnection: close\r\n\r\n",
            body.len()
        )?;
        if !line.starts_with("HEAD ") {
            stream.write_all(&body)?;
        }
        Ok(())
    }
}

/// The file that a request line asks for, below the folder that is served.
fn path(line: &str) -> Option<PathBuf> {
    let mut words = line.split_ascii_whitespace();
    let (method, target) = (words.next()?, words.next()?);
    let path = target.split(['?', '#']).next()?.strip_prefix('/')?;
    let path = Path::new(if path.is_empty() { "index.html" } else { path });
    let inside = path.components().all(|part| matches!(part, Component::Normal(_)));
    (matches!(method, "GET" | "HEAD") && inside).then(|| path.to_owned())
}

fn kind(path: &Path) -> &'static str {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("txt") => "text/plain; charset=utf-8",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_below_the_folder_are_served() {
        let served = |line| path(line).map(|path| path.display().to_string());
        assert_eq!(served("GET / HTTP/1.1").as_deref(), Some("index.html"));
        assert_eq!(served("GET /?present=copy HTTP/1.1").as_deref(), Some("index.html"));
        assert_eq!(served("HEAD /a/b.js HTTP/1.1").as_deref(), Some("a/b.js"));
        for line in [
            "GET /../Cargo.toml HTTP/1.1",
            "GET //etc/passwd HTTP/1.1",
            "POST / HTTP/1.1",
            "GET",
            "",
        ] {
            assert_eq!(served(line), None, "{line}");
        }
    }
}
