//! The slave information interface's EEPROM (ETG.2010): identity, mailboxes, and the categories that a main device reads.

use crate::esc::layout;
use crate::settings::Identity;

/// 32-bit words of the header are at fixed word addresses; categories begin here.
const CATEGORIES_AT_WORD: usize = 0x40;

/// The image of a device.
pub(crate) fn image(identity: &Identity, outputs: u16, inputs: u16) -> Vec<u8> {
    let mut image = vec![0_u8; CATEGORIES_AT_WORD * 2];
    let mut word = |at: usize, value: u16| {
        if let Some(place) = image.get_mut(at * 2..at * 2 + 2) {
            place.copy_from_slice(&value.to_le_bytes());
        }
    };
    let mut double = |at: usize, value: u32| {
        word(at, value as u16);
        word(at + 1, (value >> 16) as u16);
    };
    double(0x08, identity.vendor);
    double(0x0A, identity.product);
    double(0x0C, identity.revision);
    double(0x0E, identity.serial);
    word(0x18, layout::MAILBOX_OUT);
    word(0x19, layout::MAILBOX_SIZE);
    word(0x1A, layout::MAILBOX_IN);
    word(0x1B, layout::MAILBOX_SIZE);
    // CoE alone.
    word(0x1C, 0x0004);
    // 2 kbit, version 1.
    word(0x3E, 0x000F);
    word(0x3F, 0x0001);
    category(&mut image, 10, &strings(&[&identity.name]));
    category(&mut image, 30, &general());
    category(&mut image, 40, &[1, 2, 0, 0]);
    category(&mut image, 41, &sync_managers(outputs, inputs));
    image.extend_from_slice(&[0xFF; 4]);
    image
}

fn category(image: &mut Vec<u8>, kind: u16, body: &[u8]) {
    let words = body.len().div_ceil(2);
    image.extend_from_slice(&kind.to_le_bytes());
    image.extend_from_slice(&(words as u16).to_le_bytes());
    image.extend_from_slice(body);
    image.resize(image.len() + words * 2 - body.len(), 0);
}

fn strings(texts: &[&str]) -> Vec<u8> {
    let mut body = vec![texts.len() as u8];
    for text in texts {
        body.push(text.len() as u8);
        body.extend_from_slice(text.as_bytes());
    }
    body
}

/// Names by index of string; CoE with SDO, PDO assignment and configuration.
fn general() -> Vec<u8> {
    let mut body = vec![0_u8; 32];
    if let Some([group, image, order, name, _, coe]) = body.first_chunk_mut::<6>() {
        (*group, *image, *order, *name, *coe) = (1, 0, 1, 1, 0x0D);
    }
    body
}

/// Address, length, control, status, enable and kind of each sync manager.
fn sync_managers(outputs: u16, inputs: u16) -> Vec<u8> {
    let managers = [
        (layout::MAILBOX_OUT, layout::MAILBOX_SIZE, 0x26_u8, 1_u8),
        (layout::MAILBOX_IN, layout::MAILBOX_SIZE, 0x22, 2),
        (layout::OUTPUTS, outputs, 0x64, 3),
        (layout::INPUTS, inputs, 0x20, 4),
    ];
    let mut body = Vec::new();
    for (address, length, control, kind) in managers {
        body.extend_from_slice(&address.to_le_bytes());
        body.extend_from_slice(&length.to_le_bytes());
        body.extend_from_slice(&[control, 0, 1, kind]);
    }
    body
}
