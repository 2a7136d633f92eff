//! How much memory work takes: an allocator that counts, for each thread by itself.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// To be the program's `#[global_allocator]`.
pub struct Counting;

thread_local! {
    // Below 0 where a thread frees what another one took.
    static NOW: Cell<isize> = const { Cell::new(0) };
    static MOST: Cell<isize> = const { Cell::new(0) };
}

fn more(bytes: usize) {
    NOW.set(NOW.get() + bytes as isize);
    MOST.set(MOST.get().max(NOW.get()));
}

fn less(bytes: usize) {
    NOW.set(NOW.get() - bytes as isize);
}

// SAFETY: the system's allocator does the work; counting touches no memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        more(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        less(layout.size());
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Old and new stand side by side while the content is moved.
        more(size);
        less(layout.size());
        unsafe { System.realloc(at, layout, size) }
    }
}

/// What the work gives, and how many bytes it held at once at most, on this thread.
pub fn most<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = NOW.get();
    MOST.set(before);
    let value = work();
    (value, (MOST.get() - before) as usize)
}
