//! Arrays shared with NumPy without a copy. Each lives in a block of its own that never moves or
//! shrinks; every view holds a reference to its block, so a view outlives the simulation safely.

use std::cell::UnsafeCell;

use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// The memory behind one array.
#[pyclass(frozen)]
pub struct ArrayBlock {
    floats: UnsafeCell<Box<[f64]>>,
    words: UnsafeCell<Box<[u64]>>,
    turns: UnsafeCell<Box<[i32]>>,
}

// SAFETY: the boxes are never replaced; their elements are read and written only while the GIL is
// held, by this crate or by NumPy.
unsafe impl Sync for ArrayBlock {}
// SAFETY: as above.
unsafe impl Send for ArrayBlock {}

/// An element type that an `ArrayBlock` can hold.
pub trait Stored: Element + Copy + Default {
    /// A block of `n` elements.
    fn block(n: usize) -> ArrayBlock;
    /// Where they are.
    fn data(block: &ArrayBlock) -> *mut Self;
}

macro_rules! stored {
    ($kind:ty, $field:ident) => {
        impl Stored for $kind {
            fn block(n: usize) -> ArrayBlock {
                let mut block = ArrayBlock {
                    floats: UnsafeCell::default(),
                    words: UnsafeCell::default(),
                    turns: UnsafeCell::default(),
                };
                block.$field = UnsafeCell::new(vec![<$kind>::default(); n].into_boxed_slice());
                block
            }
            fn data(block: &ArrayBlock) -> *mut Self {
                // SAFETY: only the pointer is taken; the box itself is never replaced.
                unsafe { (*block.$field.get()).as_mut_ptr() }
            }
        }
    };
}
stored!(f64, floats);
stored!(u64, words);
stored!(i32, turns);

/// One array: its block and the NumPy view that users get.
pub struct Column<T: Stored> {
    block: Py<ArrayBlock>,
    view: Py<PyAny>,
    length: usize,
    kind: std::marker::PhantomData<T>,
}

impl<T: Stored> Column<T> {
    /// A zeroed array of shape (rows,) if `width` is 0, else (rows, width).
    pub fn new(py: Python<'_>, rows: usize, width: usize, writable: bool) -> PyResult<Self> {
        let length = rows * width.max(1);
        let block = Bound::new(py, T::block(length))?;
        let data = T::data(block.get());
        let base = block.clone().into_any();
        let view = if width == 0 {
            // SAFETY: the block holds `length` elements, never moves, and is kept alive by `base`.
            let array = unsafe {
                let view = ArrayView1::from_shape_ptr(rows, data);
                PyArray1::borrow_from_array(&view, base)
            };
            if !writable {
                array.readwrite().make_nonwriteable();
            }
            array.into_any().unbind()
        } else {
            // SAFETY: as above.
            let array = unsafe {
                let view = ArrayView2::from_shape_ptr((rows, width), data);
                PyArray2::borrow_from_array(&view, base)
            };
            debug_assert!(array.is_c_contiguous());
            if !writable {
                array.readwrite().make_nonwriteable();
            }
            array.into_any().unbind()
        };
        Ok(Self {
            block: block.unbind(),
            view,
            length,
            kind: std::marker::PhantomData,
        })
    }

    /// A view, a new object each time: what a user does to its shape or flags stays his.
    pub fn view(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.view.call_method0(py, "view")
    }

    /// The elements, for reading and writing; the token shows that the GIL is held.
    #[allow(clippy::mut_from_ref)]
    pub fn elements(&self, _: Python<'_>) -> &mut [T] {
        // SAFETY: NumPy and this crate touch the elements only with the GIL held, the crate through
        // one such slice at a time.
        unsafe { std::slice::from_raw_parts_mut(T::data(self.block.get()), self.length) }
    }
}
