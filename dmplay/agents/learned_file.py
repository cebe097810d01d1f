"""Learned agents as files: a zip of arrays, and a header in JSON; data and no code.

The file is a `.npz` that `numpy.load` reads without pickle. The entry `header.json` names the
algorithm, its parameters, the seed, the problem, the features and the learning curve, with a digest
of all that and of the arrays.
"""

import hashlib
import io
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import ZIP_DEFLATED, BadZipFile, ZipFile, ZipInfo

import numpy as np

from dmplay.agents.learned_policy import LearnedPolicy, build_features, make_follower
from dmplay.core.arrays import Array
from dmplay.core.problem import Problem
from dmplay.core.safe_files import read_bytes
from dmplay.errors import BadPolicy

FORMAT = "dmplay-learned-1"
HEADER_NAME = "header.json"
ARRAY_TYPES = ("<f8", "<i8")
MAX_ARRAYS, MAX_HEADER_BYTES, MAX_ARRAY_BYTES = 16, 2**22, 2**28
FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # of every entry, so that equal content has equal bytes
NPY_PREFIX_BYTES = 4096  # of the shape and the type of an array


class LearnedFile(NamedTuple):
    """The content of the file of a learned agent."""

    header: dict[str, Any]
    arrays: dict[str, Array]

    def make_policy(self, problem: Problem, label: str) -> LearnedPolicy:
        """Return the policy for a problem; raise BadPolicy if it was learned for another one."""
        labels = [*problem.actions[0].labels]
        learned_labels = self.header["actions"]
        if len(problem.agents) > 1 or labels != learned_labels:
            got = f"it was trained on {self.header['problem']}"
            raise BadPolicy(f"{label}: {got}, expected one agent with the actions {labels}")
        weights = self.arrays["weights"]
        features = build_features(problem, self.header["features"])
        shape: tuple[int, ...] = (features.count, len(labels))
        shape = shape[:1] if self.header["features"]["kind"] == "afterstates" else shape
        is_same_list = not isinstance(problem.state_count, int) or (
            self.header["features"].get("count", problem.state_count) == problem.state_count
        )
        if weights.shape != shape or not is_same_list:
            raise BadPolicy(f"{label}: got weights of shape {weights.shape}, expected {shape}")
        return LearnedPolicy(problem, 0, features, weights, make_follower(problem))


def compute_learned_digest(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> str:
    """Return the digest of a header without its digest, and of the arrays."""
    facts = {key: value for key, value in header.items() if key != "digest"}
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode())
    for name in sorted(arrays):
        digest.update(f"{name}{arrays[name].shape}{arrays[name].dtype.str}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return f"sha256:{digest.hexdigest()}"


def format_learned_file(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> bytes:
    """Return the bytes of a file with this header and these arrays; equal content, equal bytes."""
    facts = {"format": FORMAT, **header}
    facts["digest"] = compute_learned_digest(facts, arrays)
    entries = {HEADER_NAME: json.dumps(facts, indent=1).encode()}
    for name, array in arrays.items():
        buffer = io.BytesIO()
        np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
        entries[f"{name}.npy"] = buffer.getvalue()
    file = io.BytesIO()
    with ZipFile(file, "w", ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            entry = ZipInfo(name, FIRST_DATE)
            entry.compress_type = ZIP_DEFLATED
            archive.writestr(entry, content)
    return file.getvalue()


def read_learned_file(path: Path) -> LearnedFile:
    """Return the content of a file; raise BadPolicy in one line if it is damaged or too large."""
    try:
        with ZipFile(io.BytesIO(read_bytes(path))) as archive:
            header = _read_header(archive)
            arrays = _read_arrays(archive)
    except OSError as error:
        raise BadPolicy(f"{path}: {error.strerror}") from None
    except (
        BadZipFile,
        ValueError,
        KeyError,
        EOFError,
        RecursionError,
        NotImplementedError,
    ) as error:
        raise BadPolicy(f"{path}: not the file of a learned agent, {error}") from None
    if compute_learned_digest(header, arrays) != header["digest"]:
        raise BadPolicy(f"{path}: the digest differs, so the file was changed or damaged")
    return LearnedFile(header, arrays)


def _read_header(archive: ZipFile) -> dict[str, Any]:
    """Return the header; raise ValueError if it lacks a key."""
    names = archive.namelist()
    if len(names) > MAX_ARRAYS + 1 or HEADER_NAME not in names:
        raise ValueError(f"expected {HEADER_NAME} and at most {MAX_ARRAYS} arrays")
    if archive.getinfo(HEADER_NAME).file_size > MAX_HEADER_BYTES:
        raise ValueError(f"{HEADER_NAME} is larger than {MAX_HEADER_BYTES // 2**20} MB")
    header = json.loads(archive.read(HEADER_NAME))
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError(f"expected the format {FORMAT}")
    types = {
        "algorithm": str, "learner": str, "problem": str, "settings": dict, "seed": int,
        "actions": list, "features": dict, "curve": list, "part_steps": list, "digest": str,
    }  # fmt: skip
    for key, kind in types.items():
        if not isinstance(header.get(key), kind):
            raise ValueError(f"{HEADER_NAME} has no valid {key}")
    return header


def _read_arrays(archive: ZipFile) -> dict[str, Array]:
    """Return the arrays of finite numbers; raise ValueError if one is too large for its entry."""
    arrays = dict[str, Array]()
    for entry in archive.infolist():
        name = entry.filename.removesuffix(".npy")
        if entry.filename == HEADER_NAME:
            continue
        if entry.file_size > MAX_ARRAY_BYTES:
            raise ValueError(f"{name} is larger than {MAX_ARRAY_BYTES // 2**20} MB")
        content = io.BytesIO(archive.read(entry))
        version = np.lib.format.read_magic(content)
        if version != (1, 0):
            raise ValueError(f"{name} has an unknown version of the npy format")
        shape, _, dtype = np.lib.format.read_array_header_1_0(content, NPY_PREFIX_BYTES)
        if dtype.str not in ARRAY_TYPES or 8 * math.prod(shape) != entry.file_size - content.tell():
            raise ValueError(f"{name} is not an array of numbers")
        content.seek(0)
        arrays[name] = np.lib.format.read_array(content, allow_pickle=False)
        if not np.isfinite(arrays[name]).all():
            raise ValueError(f"{name} has a number that is not finite")
    if "weights" not in arrays:
        raise ValueError("it has no weights")
    return arrays
