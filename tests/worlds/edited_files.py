"""Files of lashbench as another program would change them: arrays, document and digest agree.

Owns the layouts of the three formats from outside, by the libraries that read them, and the
digest by its rule. It calls no writer of lashbench.
"""

import hashlib
import json
import re
from io import BytesIO

import h5py
import numpy as np
from scipy.io import loadmat, savemat

COMPLEX = ("gain", "harmonic2", "harmonic3")
NAMES = ("frequency_hz", "source_vpk", "gain", "phase_known", "gain_std_db", "phase_std_deg",
         "dc_v", "harmonic2", "harmonic3", "flags")  # fmt: skip


def edit(path, change):
    """Rewrite a file with what `change(arrays, document)` makes of its arrays and document."""
    read, write = {".h5": (_read_h5, _write_h5), ".mat": (_read_mat, _write_mat),
                   ".uff": (_read_uff, _write_uff)}[path.suffix]  # fmt: skip
    arrays, text = read(path)
    document = json.loads(text)
    change(arrays, document)
    del document["sha256"]
    if set(NAMES) <= set(arrays):
        document["sha256"] = _digest(arrays, document)
    else:
        document["sha256"] = "0" * 64
    write(path, arrays, json.dumps(document))


def _digest(arrays, document):
    digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode("ascii"))
    for name in NAMES:
        values = np.ascontiguousarray(arrays[name])
        if values.dtype.kind in "fc":
            values = values.view(np.float64)
            values = np.where(np.isnan(values), np.nan, values)
        digest.update(values.astype(values.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()


def _read_h5(path):
    with h5py.File(path) as file:
        data = file["entry/data"]
        return {name: data[name][()] for name in NAMES}, bytes(file["document"][()]).decode()


def _write_h5(path, arrays, text):
    with h5py.File(path, "r+") as file:
        data = file["entry/data"]
        for name in NAMES:
            del data[name]
        for name, values in arrays.items():
            data[name] = values
        del file["document"]
        file["document"] = np.frombuffer(text.encode(), np.uint8)


def _read_mat(path):
    held = loadmat(path)
    return {name: held[name].reshape(-1) for name in NAMES}, str(held["document"].item())


def _write_mat(path, arrays, text):
    content = BytesIO()
    savemat(content, {**arrays, "document": text}, oned_as="column")
    rest = content.getvalue()[116:]
    head = f"MATLAB 5.0 MAT-file, lashbench, sha256 {hashlib.sha256(rest).hexdigest()}"
    path.write_bytes(head.ljust(116).encode() + rest)


def _read_uff(path):
    held = json.loads("".join(re.findall(r"^\|(.*)\|$", path.read_text(), re.MULTILINE)))
    arrays = {}
    for name, values in held["rows"].items():
        if name in COMPLEX:
            both = np.array(values, dtype=float).T.copy()
            arrays[name] = both.view(complex).reshape(-1)
        else:
            kinds = {"phase_known": np.uint8, "flags": np.int64}
            arrays[name] = np.array(values, dtype=kinds.get(name, float))
    return arrays, held["document"]


def _write_uff(path, arrays, text):
    rows = {
        name: [values.real.tolist(), values.imag.tolist()] if name in COMPLEX else values.tolist()
        for name, values in arrays.items()
    }
    whole = json.dumps({"document": text, "rows": rows})
    lines = "".join(f"|{whole[at : at + 70]}|\n" for at in range(0, len(whole), 70))
    kept = path.read_text()
    first, last = kept.index("|"), kept.rindex("|")
    path.write_text(kept[:first] + lines.rstrip("\n") + kept[last + 1 :])
