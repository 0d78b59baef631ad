"""Array types of the whole package, and the border where arrays become read-only."""

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Bytes = NDArray[np.uint8]


def read_only(
    values: ArrayLike, shape: tuple[int | None, ...], *, name: str, dtype: DTypeLike = np.float64
) -> NDArray[np.generic]:
    """Return a C-contiguous copy-on-need of ``values`` that nobody can write to.

    Parameters
    ----------
    values
        Anything that NumPy turns into an array.
    shape
        Wanted shape; ``None`` leaves an axis free.
    name
        What the array is called in the error message.
    dtype
        Wanted element type.

    Returns
    -------
    array
        Read-only array of that shape and type. An array that is already so is returned itself.

    Raises
    ------
    ValueError
        If the shape differs.

    """
    array = np.ascontiguousarray(values, dtype=dtype)
    if array.ndim != len(shape) or any(
        want is not None and have != want for have, want in zip(array.shape, shape, strict=True)
    ):
        wanted = tuple("n" if want is None else want for want in shape)
        raise ValueError(f"{name} must have shape {wanted}, got {array.shape}.")
    if array.flags.writeable:
        if array is values or np.may_share_memory(array, np.asarray(values)):
            array = array.copy()
        array.setflags(write=False)
    return array
