//! The empty page, served to browsers of this machine until the command is interrupted.
//!
//! It answers two requests, for the page and for its head, and knows no other file.

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use crate::{Failure, Outcome};

/// Longest head of a request, bytes, and longest time that it may take.
const LONGEST: usize = 16 << 10;
const PATIENCE: Duration = Duration::from_secs(5);

/// Serves a page at `127.0.0.1`, at `port` or at one that is free (0), and tells its address. Returns if the address cannot be
/// had.
pub fn run(page: &str, port: u16, out: &mut dyn Write) -> Outcome {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|error| {
        Failure::new(format!("cannot serve at port {port}: {error}"), "leave out --port, and a free one is taken")
    })?;
    let address = listener.local_addr()?;
    writeln!(out, "http://{address}/ has an empty page for models to be dropped on; Ctrl-C ends it")?;
    out.flush()?;
    // Browsers open connections before they need them: none waits for another.
    std::thread::scope(|threads| {
        for stream in listener.incoming().flatten() {
            // A browser that goes away harms nobody.
            threads.spawn(move || drop(answer(stream, page)));
        }
    });
    Ok(())
}

/// Reads one request and answers it.
fn answer(mut stream: TcpStream, page: &str) -> std::io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    let head = head(&mut stream)?;
    let mut words = head.split_ascii_whitespace();
    let (method, path) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let (status, body) = match (method, path.split('?').next()) {
        ("GET" | "HEAD", Some("/")) => ("200 OK", page),
        ("GET" | "HEAD", _) => ("404 Not Found", "There is one page: /\n"),
        _ => ("405 Method Not Allowed", "The page is read only.\n"),
    };
    let kind = if status.starts_with("200") { "html" } else { "plain" };
    let length = body.len();
    let fields = format!(
        "HTTP/1.1 {status}\r\nContent-Type: text/{kind}; charset=utf-8\r\nContent-Length: {length}\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n"
    );
    stream.write_all(fields.as_bytes())?;
    if method != "HEAD" {
        stream.write_all(body.as_bytes())?;
    }
    stream.flush()
}

/// The head of a request.
fn head(stream: &mut TcpStream) -> std::io::Result<String> {
    let end = Instant::now() + PATIENCE;
    let (mut bytes, mut some) = (Vec::new(), [0; 1024]);
    while !bytes.windows(4).any(|four| four == b"\r\n\r\n") {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() || bytes.len() > LONGEST {
            return Err(ErrorKind::InvalidData.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut some)? {
            0 => return Err(ErrorKind::UnexpectedEof.into()),
            n => bytes.extend(&some[..n]),
        }
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
