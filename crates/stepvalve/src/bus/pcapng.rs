//! pcapng (draft-ietf-opsawg-pcapng), as much as a capture of one interface needs: a section header, the interface, and a block
//! for each frame, little-endian, with times in ns.

use realtime::TappedFrame;

const SECTION: u32 = 0x0A0D_0D0A;
const INTERFACE: u32 = 1;
const PACKET: u32 = 6;

/// A block's option: code, value.
type Opt<'a> = (u16, &'a [u8]);

/// What a file begins with.
pub fn header(interface: &str) -> Vec<u8> {
    let mut out = Vec::new();
    let mut section = Vec::new();
    section.extend(0x1A2B_3C4D_u32.to_le_bytes());
    // Version 1.0, a section whose length is not said.
    section.extend([1, 0, 0, 0]);
    section.extend((-1_i64).to_le_bytes());
    let program = concat!("stepvalve ", env!("CARGO_PKG_VERSION"));
    options(&mut section, &[(4, program.as_bytes())]);
    block(&mut out, SECTION, &section);
    // Ethernet, frames in full.
    let mut description = vec![1, 0, 0, 0, 0, 0, 0, 0];
    // Its name; times in units of 10^-9 s.
    options(&mut description, &[(2, interface.as_bytes()), (9, &[9])]);
    block(&mut out, INTERFACE, &description);
    out
}

/// Adds a frame.
pub fn packet(out: &mut Vec<u8>, frame: &TappedFrame<'_>) {
    let mut body = Vec::with_capacity(frame.bytes.len() + 48);
    let length = u32::try_from(frame.bytes.len()).unwrap_or(u32::MAX).to_le_bytes();
    body.extend(0_u32.to_le_bytes());
    body.extend(((frame.time_ns >> 32) as u32).to_le_bytes());
    body.extend((frame.time_ns as u32).to_le_bytes());
    body.extend(length);
    body.extend(length);
    padded(&mut body, frame.bytes);
    // Inbound or outbound.
    let direction: u32 = if frame.outgoing { 2 } else { 1 };
    options(&mut body, &[(2, &direction.to_le_bytes())]);
    block(out, PACKET, &body);
}

fn block(out: &mut Vec<u8>, kind: u32, body: &[u8]) {
    // Type, length, body, length again.
    let length = u32::try_from(body.len() + 12).unwrap_or(u32::MAX).to_le_bytes();
    out.extend(kind.to_le_bytes());
    out.extend(length);
    out.extend(body);
    out.extend(length);
}

fn options(out: &mut Vec<u8>, all: &[Opt<'_>]) {
    for (code, value) in all {
        out.extend(code.to_le_bytes());
        out.extend(u16::try_from(value.len()).unwrap_or(u16::MAX).to_le_bytes());
        padded(out, value);
    }
    out.extend([0; 4]);
}

/// Bytes, and zeros up to a multiple of four.
fn padded(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend(bytes);
    out.resize(out.len() + bytes.len().next_multiple_of(4) - bytes.len(), 0);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walks over the blocks by their lengths, as a reader does: kind and body.
    fn blocks(mut bytes: &[u8]) -> Vec<(u32, Vec<u8>)> {
        let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let mut all = Vec::new();
        while !bytes.is_empty() {
            let (kind, length) = (word(bytes, 0), word(bytes, 4) as usize);
            assert_eq!(length % 4, 0);
            assert_eq!(word(bytes, length - 4) as usize, length, "the length stands at both ends");
            all.push((kind, bytes[8..length - 4].to_vec()));
            bytes = &bytes[length..];
        }
        all
    }

    #[test]
    fn a_reader_finds_section_interface_and_frames() {
        let mut file = header("bus0");
        let sent = [0xAB; 61];
        packet(&mut file, &TappedFrame { bytes: &sent, time_ns: 0x1_0000_0002, outgoing: true });
        packet(&mut file, &TappedFrame { bytes: &sent[..4], time_ns: 3, outgoing: false });
        let blocks = blocks(&file);
        assert_eq!(
            blocks.iter().map(|(kind, _)| *kind).collect::<Vec<_>>(),
            [SECTION, INTERFACE, PACKET, PACKET]
        );
        assert!(blocks[1].1.windows(4).any(|word| word == b"bus0"));
        let first = &blocks[2].1;
        assert_eq!(first[4..20], [1, 0, 0, 0, 2, 0, 0, 0, 61, 0, 0, 0, 61, 0, 0, 0]);
        assert_eq!((&first[20..81], &first[81..84]), (&sent[..], &[0; 3][..]));
        assert_eq!(first[84..], [2, 0, 4, 0, 2, 0, 0, 0, 0, 0, 0, 0], "outbound, and the end of the options");
        assert_eq!(blocks[3].1[24..], [2, 0, 4, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
    }
}
