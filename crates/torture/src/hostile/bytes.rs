//! Damage to bytes, whatever they mean.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A few bits, bytes or stretches of `good` changed, cut out, doubled, or all after one place gone. Says what
/// was done.
pub fn damage(good: &[u8], random: &mut ChaCha8Rng) -> (Vec<u8>, String) {
    let mut bytes = good.to_vec();
    if bytes.is_empty() {
        return (bytes, "an empty file".to_owned());
    }
    let at = random.random_range(0..bytes.len());
    let stretch = random.random_range(1..200).min(bytes.len() - at);
    let story = match random.random_range(0..7) {
        0 => {
            bytes.truncate(at);
            format!("cut off after byte {at}")
        }
        1 => {
            let count = random.random_range(1..30);
            for _ in 0..count {
                let place = random.random_range(0..bytes.len());
                bytes[place] ^= 1 << random.random_range(0..8);
            }
            format!("{count} bits flipped")
        }
        2 => {
            bytes[at..at + stretch].fill_with(|| random.random());
            format!("{stretch} bytes from {at} on random")
        }
        3 => {
            bytes.drain(at..at + stretch);
            format!("{stretch} bytes from {at} on cut out")
        }
        4 => {
            let doubled = bytes[at..at + stretch].to_vec();
            bytes.splice(at..at, doubled);
            format!("{stretch} bytes from {at} on twice")
        }
        5 => {
            bytes[at..at + stretch].fill(0);
            format!("{stretch} bytes from {at} on zero")
        }
        _ => {
            let digits = b"0123456789.-+eE,;\n\"<>/=naif \t";
            let count = random.random_range(1..40);
            for _ in 0..count {
                let place = random.random_range(0..bytes.len());
                bytes[place] = digits[random.random_range(0..digits.len())];
            }
            format!("{count} characters replaced")
        }
    };
    (bytes, story)
}

/// A file that is something else altogether.
pub fn another_kind(random: &mut ChaCha8Rng) -> (Vec<u8>, String) {
    const HEADS: [(&str, &[u8]); 9] = [
        ("gzip", b"\x1f\x8b\x08\0"),
        ("zstd", b"\x28\xb5\x2f\xfd"),
        ("zip", b"PK\x03\x04"),
        ("ELF", b"\x7fELF"),
        ("PNG", b"\x89PNG\r\n\x1a\n"),
        ("UTF-16", b"\xff\xfet\0,\0q\0"),
        ("HDF5", b"\x89HDF\r\n\x1a\n"),
        ("zeros", b"\0\0\0\0\0\0\0\0"),
        ("nothing", b""),
    ];
    let (name, head) = HEADS[random.random_range(0..HEADS.len())];
    let mut bytes = head.to_vec();
    if !head.is_empty() && name != "zeros" {
        bytes.extend((0..random.random_range(0..3000)).map(|_| random.random::<u8>()));
    } else if name == "zeros" {
        bytes.resize(random.random_range(1..5000), 0);
    }
    let story = format!("a file of another kind: {name}, {} bytes", bytes.len());
    (bytes, story)
}
