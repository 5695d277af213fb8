//! EtherCAT frames as a SubDevice handles them in passing (ETG.1000.4, clause 5): Ethernet II, EtherType 0x88A4, a header of
//! two bytes, then datagrams of command, index, address, length, interrupt, data, working counter.

/// EtherType of EtherCAT.
const ETHERTYPE: [u8; 2] = [0x88, 0xA4];
const ETHERNET_HEADER: usize = 14;
const DATAGRAM_HEADER: usize = 10;
const WORKING_COUNTER: usize = 2;

/// What a datagram asks of a device (ETG.1000.4, table 4).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) command: u8,
    /// Auto-increment position or station address; the low half of a logical address.
    pub(crate) adp: u16,
    /// Register; the high half of a logical address.
    pub(crate) ado: u16,
}

impl Request {
    pub(crate) fn logical(self) -> u32 {
        u32::from(self.adp) | u32::from(self.ado) << 16
    }
}

/// Whether these bytes are an EtherCAT frame with datagrams.
pub(crate) fn is_ethercat(frame: &[u8]) -> bool {
    // Type 1 in the upper four bits: datagrams.
    frame.get(12..14) == Some(&ETHERTYPE) && frame.get(15).is_some_and(|byte| byte >> 4 == 1)
}

/// Hands each datagram to `handle`, which may change the data and says how much the working counter grows and what the
/// position address becomes. A datagram that reaches beyond the frame ends the walk, as the ESC drops it.
pub(crate) fn each_datagram(frame: &mut [u8], mut handle: impl FnMut(Request, &mut [u8]) -> (u16, u16)) {
    let mut at = ETHERNET_HEADER + 2;
    loop {
        let Some(header) = frame.get(at..at + DATAGRAM_HEADER) else { return };
        let Ok(header) = <[u8; DATAGRAM_HEADER]>::try_from(header) else { return };
        let [command, _, a, b, c, d, e, f, ..] = header;
        let request = Request { command, adp: u16::from_le_bytes([a, b]), ado: u16::from_le_bytes([c, d]) };
        let length = u16::from_le_bytes([e, f]);
        let (data_at, size) = (at + DATAGRAM_HEADER, usize::from(length & 0x7FF));
        let Some(body) = frame.get_mut(data_at..data_at + size + WORKING_COUNTER) else { return };
        let (data, counter) = body.split_at_mut(size);
        let (count, adp) = handle(request, data);
        let counted = counter.first_chunk::<2>().map_or(0, |bytes| u16::from_le_bytes(*bytes));
        counter.copy_from_slice(&counted.wrapping_add(count).to_le_bytes());
        if let Some(place) = frame.get_mut(at + 2..at + 4) {
            place.copy_from_slice(&adp.to_le_bytes());
        }
        if length & 0x8000 == 0 {
            return;
        }
        at = data_at + size + WORKING_COUNTER;
    }
}

/// Marks the frame as one that went through a device: bit 1 of the source address's first byte.
pub(crate) fn mark_processed(frame: &mut [u8]) {
    if let Some(byte) = frame.get_mut(6) {
        *byte |= 2;
    }
}
