//! Bytes for a target: the same for the same number.

use osp_testkit::boxes::Rng;

/// Random numbers, and what they do to seeds.
pub struct Generator(Rng);

/// What is wrong more often than other bytes: words between spaces, numbers first.
const WORDS: &[u8] =
    b"NaN inf -0 -1 1e39 1e-46 1e400 4294967295 4294967296 18446744073709551616 null \" [ { ( ) \n \
    \r\n \0 \\ // # , \xFF\xFE \xC3 \x1B[2J \xFF\xFF\xFF\xFF \xFF\xFF\xFF\x7F \0\0\0\x80 \0\0\x80\x7F \
    \0\0\xC0\x7F \x01\0\0\0";

impl Generator {
    pub fn new(case: u64) -> Self {
        Self(Rng(case.wrapping_mul(0xA076_1D64_78BD_642F) ^ 0x5EED))
    }

    pub fn bits(&mut self) -> u64 {
        self.0.next()
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// A changed seed, or noise where there is none.
    pub fn case(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        if seeds.is_empty() {
            let length = 1 << (4 + self.below(9));
            return (0..1 + self.below(length)).map(|_| self.bits() as u8).collect();
        }
        let mut data = seeds[self.below(seeds.len())].clone();
        for _ in 0..1 + self.below(4) {
            self.change(&mut data, seeds);
        }
        data
    }

    /// One of the first `n` words.
    fn word(&mut self, n: usize) -> &'static [u8] {
        WORDS.split(|&b| b == b' ').nth(self.below(n)).expect("a word")
    }

    /// The first byte chooses what the others are: it stays.
    fn change(&mut self, data: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        if data.len() < 2 {
            data.push(self.bits() as u8);
            return;
        }
        let at = 1 + self.below(data.len() - 1);
        let length = 1 + self.below((data.len() - at).min(64));
        match self.below(9) {
            0 => data[at] ^= 1 << self.below(8),
            1 => data[at] = self.bits() as u8,
            2 => data.truncate(at),
            3 => drop(data.drain(at..at + length)),
            4 => {
                let piece = data[at..at + length].to_vec();
                let to = 1 + self.below(data.len() - 1);
                drop(data.splice(to..to, piece));
            }
            kind @ 5..=6 => {
                let word = self.word(32);
                let end = if kind == 5 { (at + word.len()).min(data.len()) } else { at };
                drop(data.splice(at..end, word.iter().copied()));
            }
            7 => self.change_number(data, at),
            _ => {
                let other = &seeds[self.below(seeds.len())];
                let from = self.below(other.len());
                data.truncate(at);
                data.extend_from_slice(&other[from..]);
            }
        }
    }

    /// Replaces a written number near a place by another.
    fn change_number(&mut self, data: &mut Vec<u8>, at: usize) {
        let is_of_number = |b: &u8| b.is_ascii_digit() || *b == b'.' || *b == b'-';
        let Some(start) = data[at..].iter().position(is_of_number).map(|i| at + i) else { return };
        let end = data[start..].iter().position(|b| !is_of_number(b)).map_or(data.len(), |i| start + i);
        drop(data.splice(start..end, self.word(10).iter().copied()));
    }
}
