//! Lines of a text file of any size, without an allocation for each.

use crate::map::open_regular;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Large enough to make reading cheap; a longer line makes the buffer grow.
const CHUNK: usize = 1 << 20;
/// Enough for faces of a million corners. What has longer lines is no OBJ file, and would fill memory.
const MAX_LINE: usize = 1 << 26;

/// Reads lines. A line that ends in a backslash goes on in the next one, except for comments.
pub(super) struct Lines {
    file: File,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    at_end: bool,
    /// Line feed, or carriage return in files from before 2001.
    separator: u8,
    bytes_read: u64,
    line: u64,
    next_line: u64,
}

impl Lines {
    pub fn open(path: &Path) -> io::Result<Lines> {
        let mut lines = Lines {
            file: open_regular(path)?,
            buffer: vec![0; CHUNK],
            start: 0,
            end: 0,
            at_end: false,
            separator: b'\n',
            bytes_read: 0,
            line: 0,
            next_line: 1,
        };
        lines.fill()?;
        if lines.first_bytes().starts_with(b"\xef\xbb\xbf") {
            lines.start = 3;
        }
        if memchr::memchr(b'\n', lines.first_bytes()).is_none() && lines.first_bytes().contains(&b'\r') {
            lines.separator = b'\r';
        }
        Ok(lines)
    }

    /// What is in memory of the file before the first call of `next`: its first megabyte.
    pub fn first_bytes(&self) -> &[u8] {
        &self.buffer[self.start..self.end]
    }

    pub fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Number of the line that `next` gave last, the first being 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The next line without its end, or `None` at the end of the file.
    #[inline]
    pub fn next(&mut self) -> io::Result<Option<&[u8]>> {
        self.line = self.next_line;
        let mut length = 0;
        loop {
            let unseen = self.start + length..self.end;
            if let Some(found) = memchr::memchr(self.separator, &self.buffer[unseen]) {
                length += found;
                self.next_line += 1;
                if !self.goes_on(length) {
                    let line = self.start..self.start + length;
                    self.start = line.end + 1;
                    return Ok(Some(&self.buffer[line]));
                }
                self.join(&mut length);
            } else {
                length = self.end - self.start;
                if self.at_end {
                    let line = self.start..self.end;
                    self.start = self.end;
                    return Ok((!line.is_empty()).then(|| &self.buffer[line]));
                }
                self.fill()?;
            }
        }
    }

    /// True if the line of this length ends in a backslash.
    fn goes_on(&self, length: usize) -> bool {
        let line = &self.buffer[self.start..self.start + length];
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        line.ends_with(b"\\") && !line.trim_ascii_start().starts_with(b"#")
    }

    /// Replaces the end of the line and the backslash before it by blanks.
    fn join(&mut self, length: &mut usize) {
        let end = self.start + *length;
        let backslash = if self.buffer[end - 1] == b'\r' { end - 2 } else { end - 1 };
        self.buffer[backslash..=end].fill(b' ');
        *length += 1;
    }

    /// Reads more behind what is there.
    fn fill(&mut self) -> io::Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        if self.end >= MAX_LINE {
            let what = format!("line {} has more than {MAX_LINE} bytes; split or remove it", self.line);
            return Err(io::Error::other(what));
        }
        if self.end == self.buffer.len() {
            self.buffer.resize(2 * self.end, 0);
        }
        while self.end < self.buffer.len() && !self.at_end {
            match self.file.read(&mut self.buffer[self.end..]) {
                Ok(0) => self.at_end = true,
                Ok(count) => {
                    self.end += count;
                    self.bytes_read += count as u64;
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn lines(text: &[u8]) -> Vec<(u64, String)> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text).unwrap();
        let mut lines = Lines::open(file.path()).unwrap();
        let mut all = Vec::new();
        while let Some(line) = lines.next().unwrap() {
            let line = String::from_utf8(line.to_vec()).unwrap();
            all.push((lines.line(), line));
        }
        all
    }

    #[test]
    fn ends_of_lines_of_all_kinds() {
        let expected = [(1, "a".into()), (2, "b".into())];
        assert_eq!(lines(b"a\nb"), expected);
        assert_eq!(lines(b"\xef\xbb\xbfa\nb\n"), expected);
        assert_eq!(lines(b"a\rb\r"), expected);
        assert_eq!(lines(b"a\r\nb\r\n"), [(1, "a\r".into()), (2, "b\r".into())]);
        assert_eq!(lines(b""), []);
    }

    #[test]
    fn backslashes_join_lines() {
        assert_eq!(lines(b"a\\\nb\\\r\nc\nd"), [(1, "a  b   c".into()), (4, "d".into())]);
        assert_eq!(lines(b"# a\\\nb"), [(1, "# a\\".into()), (2, "b".into())]);
        assert_eq!(lines(b"a\\\n"), [(1, "a  ".into())]);
        assert_eq!(lines(b"\\\n\\\n"), [(1, "    ".into())]);
    }

    #[test]
    fn lines_longer_than_the_buffer() {
        let text = "x".repeat(3 * CHUNK);
        assert_eq!(lines(format!("{text}\n{text}\\\n{text}\n").as_bytes()).len(), 2);
    }

    #[test]
    fn lines_do_not_fill_memory() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"a\n").unwrap();
        file.as_file().set_len(2 * MAX_LINE as u64).unwrap();
        let mut lines = Lines::open(file.path()).unwrap();
        assert_eq!(lines.next().unwrap(), Some(&b"a"[..]));
        let error = lines.next().unwrap_err().to_string();
        assert!(error.starts_with("line 2 has more than"), "{error}");
    }
}
