//! Pointers of the caller's, and the states that live where they point.

use core::sync::atomic::{Ordering, compiler_fence};

use crate::status::{Status, StatusResult};

/// Storage that the caller owns, and in which a state lives.
pub trait Storage {
    /// State that lives in it.
    type State;
    /// Marks storage in which the state lives.
    const MARK: u32;
}

/// A state behind its mark. While a call that changes the state is under way, the mark is another.
#[repr(C)]
struct Slot<T> {
    mark: u32,
    state: T,
}

fn check<T>(pointer: *const T) -> StatusResult {
    if pointer.is_null() {
        Err(Status::TumbleErrorNull)
    } else if !pointer.is_aligned() {
        Err(Status::TumbleErrorUnaligned)
    } else {
        Ok(())
    }
}

/// Takes over what the caller points to.
///
/// # Safety
/// Unless null or unaligned, the pointer leads to a value of its type.
pub unsafe fn read<T: Copy>(pointer: *const T) -> StatusResult<T> {
    check(pointer)?;
    // SAFETY: checked, and the caller's word for the rest.
    Ok(unsafe { pointer.read() })
}

/// Looks at what the caller points to.
///
/// # Safety
/// The same as for [`read`]; besides, nobody changes the value meanwhile.
pub unsafe fn look<'a, T>(pointer: *const T) -> StatusResult<&'a T> {
    check(pointer)?;
    // SAFETY: checked, and the caller's word for the rest.
    Ok(unsafe { &*pointer })
}

/// A place that a result can be written to.
pub struct Place<T>(*mut T);

impl<T> Place<T> {
    /// Where the caller wants the result.
    ///
    /// # Safety
    /// Unless null or unaligned, there is room for a value of the type for as long as the place is kept.
    pub unsafe fn at(pointer: *mut T) -> StatusResult<Self> {
        check(pointer)?;
        Ok(Self(pointer))
    }

    /// The same, where null stands for a result that is not wanted.
    ///
    /// # Safety
    /// The same as for [`Place::at`].
    pub unsafe fn if_wanted(pointer: *mut T) -> StatusResult<Option<Self>> {
        if pointer.is_null() {
            return Ok(None);
        }
        // SAFETY: the same is asked of the caller.
        unsafe { Self::at(pointer) }.map(Some)
    }

    /// Writes the result.
    pub fn write(&self, value: T) {
        // SAFETY: as was promised when the place was made.
        unsafe { self.0.write(value) }
    }
}

/// Writes what was found to where it is wanted.
pub fn answer<T>(place: StatusResult<Place<T>>, found: StatusResult<T>) -> Status {
    match (place, found) {
        (Ok(place), Ok(found)) => {
            place.write(found);
            Status::TumbleOk
        }
        (_, Err(status)) | (Err(status), _) => status,
    }
}

/// Puts a state into storage, for which the caller states `size` bytes. The mark is not looked at: memory that
/// outlasted a reset in the middle of a call would be refused for ever.
///
/// # Safety
/// Unless null or unaligned, the pointer leads to room for a value of its type, which nobody else uses meanwhile.
pub unsafe fn begin<S: Storage>(
    storage: *mut S,
    size: usize,
    state: impl FnOnce() -> StatusResult<S::State>,
) -> StatusResult {
    // SAFETY: the place of a state takes one; the same is asked of the caller.
    let write = |state, place: *mut S::State| unsafe { place.write(state) };
    // SAFETY: the same.
    unsafe { begin_in_place(storage, size, state, write) }
}

/// Puts a state into storage as [`begin`] does, of what `prepare` returns; `write` writes it to its place. A state that is
/// large makes no copy on the stack so.
///
/// # Safety
/// The same as for [`begin`]; besides, `write` writes a state to the pointer that it gets.
pub unsafe fn begin_in_place<S: Storage, P>(
    storage: *mut S,
    size: usize,
    prepare: impl FnOnce() -> StatusResult<P>,
    write: impl FnOnce(P, *mut S::State),
) -> StatusResult {
    const {
        assert!(size_of::<Slot<S::State>>() <= size_of::<S>());
        assert!(align_of::<Slot<S::State>>() <= align_of::<S>());
    }
    check(storage)?;
    if size != size_of::<S>() {
        return Err(Status::TumbleErrorSize);
    }
    let prepared = prepare()?;
    let slot = storage.cast::<Slot<S::State>>();
    // SAFETY: a slot fits into the storage, in size and alignment. There may be no state yet, so that only addresses are taken.
    let (mark, state) = unsafe { (&raw mut (*slot).mark, &raw mut (*slot).state) };
    // SAFETY: the same. A reset in the middle leaves no mark beside half a state.
    unsafe { mark.write_volatile(0) };
    compiler_fence(Ordering::SeqCst);
    write(prepared, state);
    compiler_fence(Ordering::SeqCst);
    // SAFETY: the same.
    unsafe { mark.write_volatile(S::MARK) };
    Ok(())
}

fn check_mark<S: Storage>(mark: u32) -> StatusResult {
    if mark == S::MARK {
        Ok(())
    } else if mark == !S::MARK {
        Err(Status::TumbleErrorBusy)
    } else {
        Err(Status::TumbleErrorNotInitialised)
    }
}

/// Changes the state in storage.
///
/// # Safety
/// Unless null or unaligned, the pointer leads to storage of the type, initialised or not.
pub unsafe fn change<S: Storage, R>(
    storage: *mut S,
    work: impl FnOnce(&mut S::State) -> StatusResult<R>,
) -> StatusResult<R> {
    check(storage)?;
    let slot = storage.cast::<Slot<S::State>>();
    // SAFETY: a slot fits into the storage. The mark is reached by the pointer alone, so that a call from within a callback
    // may look at it while the state is borrowed.
    let mark = unsafe { &raw mut (*slot).mark };
    // SAFETY: any four bytes are a u32.
    check_mark::<S>(unsafe { mark.read_volatile() })?;
    // SAFETY: the same.
    unsafe { mark.write_volatile(!S::MARK) };
    // That the mark is volatile does not order it among accesses that are not: work might be done before it is set or after
    // it is restored, where an interrupt takes storage for idle whose state is half changed.
    compiler_fence(Ordering::SeqCst);
    // SAFETY: the mark proves that the state was put there, and that no other call is using it.
    let outcome = work(unsafe { &mut (*slot).state });
    compiler_fence(Ordering::SeqCst);
    // SAFETY: the same place again.
    unsafe { mark.write_volatile(S::MARK) };
    outcome
}

/// Looks at the state in storage, which several may do at once: so the mark stays, and it is for the caller to see to that
/// nobody changes the state meanwhile.
///
/// # Safety
/// The same as for [`change`]; besides, nobody changes the state until this returns.
pub unsafe fn view<S: Storage, R>(storage: *const S, work: impl FnOnce(&S::State) -> R) -> StatusResult<R> {
    check(storage)?;
    let slot = storage.cast::<Slot<S::State>>();
    // SAFETY: a slot fits into the storage, and any four bytes are a u32.
    check_mark::<S>(unsafe { (&raw const (*slot).mark).read_volatile() })?;
    // SAFETY: the mark proves that the state was put there, and that no call was changing it; the caller ensures that
    // none begins to.
    Ok(work(unsafe { &(*slot).state }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::redundancy::Redundancy;
    use crate::spin::Spin;
    use crate::store::Store;

    /// Words of storage, and those that its state takes.
    fn words<S: Storage>() -> (usize, usize) {
        (size_of::<S>() / 8, size_of::<Slot<S::State>>().div_ceil(8))
    }

    #[test]
    fn storage_is_hardly_larger_than_what_lives_in_it() {
        for (name, (storage, state)) in [
            ("spin", words::<Spin>()),
            ("redundancy", words::<Redundancy>()),
            ("store", words::<Store>()),
        ] {
            let spare = storage - state;
            assert!(spare * 10 <= storage + 10, "{name}: {storage} words for {state}");
        }
    }
}
