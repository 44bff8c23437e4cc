//! Slots of a bank whose entries are still of use, when its other entries are left behind.

use embedded_storage::nor_flash::NorFlash;

use crate::checksum::CHECKSUM;
use crate::flash::bank::{Bank, Banks};
use crate::flash::entry::{Entry, Label};
use crate::flash::words::Seen;

/// Labels that are followed in one pass over a bank; more take more passes, over what the first left.
const LABELS: usize = 8;

/// A run of slots, some of which are in it.
pub struct Slots([u32; WORDS]);

const WORDS: usize = 32;

impl Slots {
    /// Slots that a run has.
    pub const COUNT: u32 = u32::BITS * WORDS as u32;

    fn none() -> Self {
        Self([0; WORDS])
    }

    fn word(place: u32) -> usize {
        usize::try_from(place / u32::BITS).unwrap_or(WORDS)
    }

    /// Checks whether a slot is in it.
    pub fn has(&self, place: u32) -> bool {
        let word = self.0.get(Self::word(place));
        word.is_some_and(|word| word & (1 << (place % u32::BITS)) != 0)
    }

    fn add(&mut self, place: u32) {
        if let Some(word) = self.0.get_mut(Self::word(place)) {
            *word |= 1 << (place % u32::BITS);
        }
    }

    /// Number of slots in it.
    pub fn count(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }
}

/// Entries of a label that may still be found of use, from the last one backwards.
struct Quota {
    label: Label,
    left: u8,
    /// Checksum of the record after the one that is looked at.
    signature: [u8; CHECKSUM],
}

/// Quotas of the labels that were met.
struct Quotas([Option<Quota>; LABELS]);

impl Quotas {
    /// Counts an entry; returns whether it is of use, or `None` where its label is one too many.
    fn count(&mut self, label: Label, kept: u8, signature: [u8; CHECKSUM]) -> Option<bool> {
        for place in &mut self.0 {
            match place {
                None => {
                    let left = kept.saturating_sub(1);
                    *place = Some(Quota {
                        label,
                        left,
                        signature,
                    });
                    return Some(true);
                }
                Some(quota) if quota.label == label => {
                    // One that was written again, for it to be firm, stands for both.
                    let is_of_use = quota.left > 0 && quota.signature != signature;
                    quota.left -= u8::from(is_of_use);
                    quota.signature = signature;
                    return Some(is_of_use);
                }
                Some(_) => {}
            }
        }
        None
    }
}

impl<F: NorFlash> Banks<F> {
    /// Finds which of a run of slots from one on hold entries that are of use: the last of each sensor and kind, and of
    /// those adopted the previous one where it is to be kept.
    #[inline(never)]
    pub fn useful(&mut self, bank: &Bank, first: u32, with_previous: bool) -> Seen<Slots, F> {
        let (mut done, mut useful, mut entry) = (Slots::none(), Slots::none(), Entry::blank());
        let mut end = self.end(bank)?;
        while end > first {
            let mut quotas = Quotas([const { None }; LABELS]);
            let mut left = first;
            for slot in (first..end).rev() {
                let place = slot - first;
                if done.has(place) {
                    continue;
                }
                let label = self
                    .fetch(bank, slot, &mut entry)?
                    .then(|| entry.label())
                    .flatten();
                let kind = label.and_then(|label| Some((label, label.kind()?)));
                let counted = kind.map_or(Some(false), |(label, kind)| {
                    quotas.count(label, kind.kept(with_previous), entry.record_signature())
                });
                match counted {
                    None => left = left.max(slot + 1),
                    Some(is_of_use) => {
                        done.add(place);
                        if is_of_use {
                            useful.add(place);
                        }
                    }
                }
            }
            end = left;
        }
        Ok(useful)
    }
}
