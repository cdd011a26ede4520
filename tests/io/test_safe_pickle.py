"""Files of strangers: plain data comes out whole, anything else is refused and never runs."""

from __future__ import annotations

import collections
import gzip
import io
import lzma
import os
import pickle
import struct
import sys
import types
import zipfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.safe_pickle import Sparse, load_untrusted
from markerscope.solver.safe_pickle.limits import Damaged, Forbidden

RNG = np.random.default_rng(0)
STRUCTURED = np.array([(1, 2.5), (3, 4.5)], dtype=[("a", "i4"), ("b", "f8")])
ARRAYS = {
    "float32": RNG.normal(size=(3, 4)).astype(np.float32),
    "fortran": np.asfortranarray(RNG.normal(size=(3, 4))),
    "big endian": RNG.normal(size=5).astype(">f8"),
    "view": RNG.normal(size=(6, 6))[::2, 1::3],
    "bool": np.array([True, False]),
    "text": np.array(["ab", "cde"]),
    "bytes": np.array([b"ab", b"cde"]),
    "complex": np.array([1 + 2j]),
    "empty": np.zeros((0, 3)),
    "zero-dimensional": np.array(7.0),
    "structured": STRUCTURED,
}
PLAIN = {
    "numbers": [1, -5, 2**80, 1.5, 1j, True, None],
    "text": ("é", b"\xff", bytearray(b"ab")),
    "sets": ({1, 2}, frozenset({"a", (1, 2)})),
    "nested": [[[[]]], {}, {"x": {1: 2}}],
    "ordered": collections.OrderedDict(a=1),
    "defaulting": collections.defaultdict(dict, {0: {"pose": 1}}),
    "scalars": [np.float32(2.5), np.int64(3), np.bool_(True)],
}


def put(folder: Path, data: bytes, name: str = "file.pkl") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        if a.dtype == object:
            return a.shape == b.shape and all(same(x, y) for x, y in zip(a.ravel(), b.ravel(), strict=True))
        return a.shape == b.shape and a.dtype.newbyteorder("=") == b.dtype.newbyteorder("=") and bool((a == b).all())
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple):
        return type(a) is type(b) and len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return a == b


# what may pass --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("protocol", range(6))
def test_plain_pickles_come_back_the_same(tmp_path: Path, protocol: int) -> None:
    twice = RNG.normal(size=3)
    data = {
        "plain": PLAIN,
        "arrays": ARRAYS,
        "shared": [twice, twice],
        "objects": np.array([{"a": 1}, None, twice], dtype=object),
    }
    found = load_untrusted(put(tmp_path, pickle.dumps(data, protocol)))
    assert same(found, data), f"protocol {protocol}: {found}"
    assert found["shared"][0] is found["shared"][1]
    found["arrays"]["float32"][0, 0] = 1  # an array of its own, not a view of the file


@settings(max_examples=60, deadline=None)
@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | st.binary(),
        lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text() | st.integers(), inner),
        max_leaves=20,
    ),
    st.integers(0, 5),
)
def test_any_plain_data_comes_back(tmp_path_factory: pytest.TempPathFactory, data: object, protocol: int) -> None:
    found = load_untrusted(put(tmp_path_factory.mktemp("plain"), pickle.dumps(data, protocol)))
    assert same(found, data), f"{found!r} for {data!r}"


def test_numpy_files_come_back_the_same(tmp_path: Path) -> None:
    for name, array in ARRAYS.items():
        np.save(tmp_path / "a.npy", array)
        assert same(load_untrusted(tmp_path / "a.npy"), array), name
    np.savez_compressed(
        tmp_path / "a.npz", **{k.replace(" ", "_"): a for k, a in ARRAYS.items()}, thing={"pose": ARRAYS["float32"]}
    )
    found = load_untrusted(tmp_path / "a.npz")
    assert same(found["float32"], ARRAYS["float32"])
    assert same(found["thing"], {"pose": ARRAYS["float32"]})
    np.save(tmp_path / "d.npy", {"pred_rotmat": ARRAYS["float32"]}, allow_pickle=True)
    assert same(load_untrusted(tmp_path / "d.npy"), {"pred_rotmat": ARRAYS["float32"]})


@pytest.mark.parametrize("compress", [0, 3, ("zlib", 3), ("gzip", 3), ("bz2", 3), ("lzma", 3), ("xz", 3)])
def test_joblib_dumps_come_back_the_same(tmp_path: Path, compress: object) -> None:
    joblib = pytest.importorskip("joblib")
    data = {
        "frame": {"tid": [1], "smpl": [ARRAYS]},
        "objects": np.array([ARRAYS["bool"], "x"], dtype=object),
        "last": 1,
    }
    joblib.dump(data, tmp_path / "a.pkl", compress=compress)
    found = load_untrusted(tmp_path / "a.pkl")
    assert same(found, data), found


@pytest.mark.parametrize("zipped", [True, False])
def test_torch_files_come_back_as_arrays(tmp_path: Path, zipped: bool) -> None:
    torch = pytest.importorskip("torch")
    base = torch.arange(24, dtype=torch.float64).reshape(2, 3, 4)
    tensors = {
        "view": base[:, 1:, ::2],
        "transposed": base.transpose(0, 2),
        "expanded": torch.ones(1, 3).expand(5, 3),
        "half": torch.tensor([1.5], dtype=torch.float16),
        "bfloat16": torch.tensor([1.5, -2.0], dtype=torch.bfloat16),
        "long": torch.arange(3),
        "bool": torch.tensor([True, False]),
        "scalar": torch.tensor(2.5),
        "empty": torch.zeros(0, 3),
        "parameter": torch.nn.Parameter(torch.ones(2)),
        "uint16": torch.tensor([1, 65535], dtype=torch.uint16),
    }
    data = {"smpl_params_incam": tensors, "state": torch.nn.Linear(2, 1).state_dict(), "size": base.shape}
    torch.save(data, tmp_path / "a.pt", _use_new_zipfile_serialization=zipped)
    found = load_untrusted(tmp_path / "a.pt")
    for name, tensor in tensors.items():
        expected = tensor.detach().float().numpy() if name == "bfloat16" else tensor.detach().numpy()
        assert same(found["smpl_params_incam"][name], expected), name
    assert found["state"]["weight"].shape == (1, 2)
    assert found["size"] == (2, 3, 4)


def test_tensors_inside_plain_pickles_and_npy(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    data = {"pred_rotmat": torch.eye(3).expand(4, 24, 3, 3).contiguous(), "frame": torch.arange(4)}
    np.save(tmp_path / "a.npy", data, allow_pickle=True)
    (tmp_path / "b.pkl").write_bytes(pickle.dumps(data))
    for name in ("a.npy", "b.pkl"):
        found = load_untrusted(tmp_path / name)
        assert same(found["pred_rotmat"], data["pred_rotmat"].numpy())
        assert same(found["frame"], data["frame"].numpy())


@pytest.mark.parametrize("layout", ["csc", "csr", "coo"])
@pytest.mark.parametrize("protocol", [0, 2, 4])
def test_sparse_matrices_match_scipy(tmp_path: Path, layout: str, protocol: int) -> None:
    import scipy.sparse

    matrix = scipy.sparse.random(24, 50, 0.1, layout, rng=0)
    found = load_untrusted(put(tmp_path, pickle.dumps({"J_regressor": matrix}, protocol)))["J_regressor"]
    assert isinstance(found, Sparse)
    assert np.array_equal(found.toarray(), matrix.toarray())


def python2_pickle(value: bytes) -> bytes:
    """What Python 2 wrote for ``numpy.frombuffer(value, 'u1')``: module names of old, raw data as a str."""
    return (
        b"\x80\x02}U\x04poseccopy_reg\n_reconstructor\ncchumpy.ch\nCh\nc__builtin__\nobject\nN\x87R}U\x01x"
        b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85U\x01b\x87R(K\x01K"
        + bytes([len(value)])
        + b"\x85cnumpy\ndtype\nU\x02u1K\x00K\x01\x87R(K\x03U\x01|NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb\x89U"
        + bytes([len(value)])
        + value
        + b"tbsbs."
    )


def test_python_2_pickles_are_read_as_latin_1(tmp_path: Path) -> None:
    value = bytes(range(0, 250, 3))
    found = load_untrusted(put(tmp_path, python2_pickle(value)))
    assert found["pose"].tobytes() == value
    text = b"(dp0\nS'na\\xefve'\np1\nI3\ns."
    assert load_untrusted(put(tmp_path, text)) == {"naïve": 3}


def test_chumpy_arrays_are_their_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = types.ModuleType("chumpy.ch")
    ch = type("Ch", (), {"__module__": "chumpy.ch"})
    module.Ch = ch
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    monkeypatch.setitem(sys.modules, "chumpy.ch", module)
    value = ch()
    value.x, value._dirty_vars, value._itr = ARRAYS["float32"], {"x"}, None
    for protocol in range(5):
        found = load_untrusted(put(tmp_path, pickle.dumps([value, value], protocol)))
        assert same(found, [ARRAYS["float32"]] * 2)


# what may not ---------------------------------------------------------------------------------------------------------
class Calls:
    """Pickles to a call of ``function(*arguments)``."""

    def __init__(self, function: object, *arguments: object, state: object = None) -> None:
        self.parts = (function, arguments) if state is None else (function, arguments, state)

    def __reduce__(self) -> tuple:
        return self.parts


def attacks(flag: Path) -> dict[str, object]:
    command = f"touch {flag}"
    script = f"open({str(flag)!r}, 'w')"
    return {
        "posix.system": Calls(os.system, command),
        "builtins.eval": Calls(eval, script),
        "builtins.exec": Calls(exec, script),
        "functools.partial": Calls(partial, os.system, command),
        "builtins.getattr": Calls(getattr, "text", "upper"),
        "builtins.map": Calls(map, os.system, [command]),
        "io.open": Calls(open, str(flag), "w"),
        "builtins.__import__": Calls(__import__, "os"),
        "numpy.load": Calls(np.load, str(flag)),
        "numpy.fromfile": Calls(np.fromfile, str(flag)),
        "operator.attrgetter": Calls(__import__("operator").attrgetter, "system"),
        "types.SimpleNamespace": types.SimpleNamespace(a=1),
        "builtins.type": Calls(type, "X", (), {}),
        "pathlib": flag,
    }


@pytest.mark.parametrize("name", list(attacks(Path("x"))))
@pytest.mark.parametrize(
    "wrapping", ["plain", "nested", "object array", "npy", "npz", "joblib", "torch", "legacy torch", "zlib"]
)
def test_a_malicious_pickle_does_not_run(tmp_path: Path, name: str, wrapping: str) -> None:
    flag = tmp_path / "ran"
    payload = attacks(flag)[name]
    path = tmp_path / "bad.bin"
    objects = np.array([payload, 1], dtype=object)
    if wrapping == "plain":
        path.write_bytes(pickle.dumps(payload))
    elif wrapping == "nested":
        path.write_bytes(pickle.dumps({"poses": [1, ("x", payload)]}, 2))
    elif wrapping == "object array":
        path.write_bytes(pickle.dumps(objects))
    elif wrapping == "npy":
        np.save(tmp_path / "x.npy", objects, allow_pickle=True)
        path = tmp_path / "x.npy"
    elif wrapping == "npz":
        np.savez(tmp_path / "x.npz", poses=np.zeros(3), extra=objects)
        path = tmp_path / "x.npz"
    elif wrapping == "joblib":
        pytest.importorskip("joblib").dump({"a": objects}, path, compress=3)
    elif wrapping == "zlib":
        path.write_bytes(zlib.compress(pickle.dumps(payload)))
    else:
        pytest.importorskip("torch").save({"a": payload}, path, _use_new_zipfile_serialization=wrapping == "torch")
    # A process that has loaded Qt has another function for imports: its name is asked for then.
    wanted = __import__.__name__ if name == "builtins.__import__" else name.rpartition(".")[2]
    with pytest.raises(InputError, match=wanted) as caught:
        load_untrusted(path)
    assert str(caught.value).count("\n") == 0
    assert not flag.exists()


def handmade(*parts: bytes) -> bytes:
    return b"\x80\x04" + b"".join(parts) + b"."


def short(text: str) -> bytes:
    return b"\x8c" + bytes([len(text)]) + text.encode()


@pytest.mark.parametrize(
    "data",
    {
        "dotted name": handmade(short("numpy"), short("ndarray.__class__"), b"\x93"),
        "attribute of an allowed module": handmade(short("numpy"), short("lib"), b"\x93"),
        "state set on an allowed class": handmade(b"cnumpy\nndarray\n", b"}", short("__setstate__"), b"K\x01sb"),
        "state set on an array": handmade(
            b"cnumpy.core.multiarray\nscalar\n(cnumpy\ndtype\n(", short("f8"), b"tRC\x08", bytes(8), b"tR}b"
        ),
        "a call of data": handmade(short("os"), b")R"),
        "a call of an allowed class that makes nothing": handmade(b"cnumpy\nndarray\n(K\x05tR"),
        "bytearray of a size": handmade(b"c__builtin__\nbytearray\n(J\xff\xff\xff\x7ftR"),
        "extension code": handmade(b"\x82\x01"),
        "persistent id": handmade(b"K\x01Q"),
        "out-of-band buffer": handmade(b"\x97"),
        "another codec": handmade(b"c_codecs\nencode\n(", short("a"), short("rot13"), b"tR"),
        "element type by class": handmade(b"cnumpy\ndtype\n(c__builtin__\nobject\ntR"),
        "old instance": handmade(b"(", short("touch x"), b"ios\nsystem\n"),
        "old object": handmade(b"(cos\nsystem\n", short("touch x"), b"o"),
        "reconstructor of a stranger": handmade(b"ccopy_reg\n_reconstructor\n(cos\nsystem\nc__builtin__\nobject\nNtR"),
        "objects in raw memory": handmade(
            b"cnumpy.core.multiarray\nscalar\n(cnumpy\ndtype\n(", short("O8"), b"tRC\x08", b"\x01" * 8, b"tR"
        ),
    }.items(),
    ids=lambda item: item[0],
)
def test_tricks_are_refused(tmp_path: Path, data: tuple[str, bytes]) -> None:
    with pytest.raises(InputError):
        load_untrusted(put(tmp_path, data[1]))


def test_a_name_cannot_forge_the_message(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load_untrusted(put(tmp_path, handmade(short("os\n\x1b[2J"), short("y" * 200), b"\x93")))
    assert "\n" not in str(caught.value) and "\x1b" not in str(caught.value) and len(str(caught.value)) < 400


@pytest.mark.parametrize("compress", [zlib.compress, gzip.compress, partial(lzma.compress, preset=0)])
def test_a_decompression_bomb_is_refused(tmp_path: Path, compress: Callable[[bytes], bytes]) -> None:
    with pytest.raises(InputError, match="far more data"):
        load_untrusted(put(tmp_path, compress(bytes(100 << 20))))


def test_a_zip_bomb_is_refused(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("poses.npy", bytes(100 << 20))
    with pytest.raises(InputError, match="far more data"):
        load_untrusted(put(tmp_path, buffer.getvalue(), "a.npz"))


def npy(shape: str, data: bytes = b"", dtype: str = "<f8") -> bytes:
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + data


def test_claimed_sizes_are_not_believed(tmp_path: Path) -> None:
    assert np.array_equal(load_untrusted(put(tmp_path, npy("(2,)", bytes(16)))), np.zeros(2)), "the header is right"
    for shape in ("(1000000000000,)", "(3,)", "(-1,)", "(2, -5)"):
        with pytest.raises(InputError):
            load_untrusted(put(tmp_path, npy(shape, bytes(16))))
    with pytest.raises(InputError):
        load_untrusted(put(tmp_path, npy("(1000000000000,)", b"", "<U0")))
    wrapper = (
        b"cjoblib.numpy_pickle\nNumpyArrayWrapper\n)\x81}(X\x05\x00\x00\x00shapeJ\xff\xff\xff\x7f\x85X\x05\x00\x00\x00orderX\x01\x00\x00\x00C"
        b"X\x05\x00\x00\x00dtypecnumpy\ndtype\n(X\x02\x00\x00\x00f8tRub"
    )
    with pytest.raises(InputError, match="claims far more"):
        load_untrusted(put(tmp_path, handmade(wrapper)))


def test_an_expanded_tensor_cannot_fill_the_memory(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    torch.save({"pose": torch.zeros(1).expand(10**9)}, tmp_path / "a.pt")
    with pytest.raises(InputError, match="claims far more"):
        load_untrusted(tmp_path / "a.pt")


def test_a_tensor_cannot_read_beyond_its_storage(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    torch.save(torch.zeros(4), tmp_path / "a.pt")
    with zipfile.ZipFile(tmp_path / "a.pt") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for name in members:
        if name.endswith("data.pkl"):
            assert members[name].count(b"K\x04\x85") == 1  # the size (4,)
            members[name] = members[name].replace(b"K\x04\x85", b"K\x05\x85")
    with zipfile.ZipFile(tmp_path / "b.pt", "w") as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    with pytest.raises(InputError, match="beyond its data"):
        load_untrusted(tmp_path / "b.pt")


def test_sparse_indices_are_checked(tmp_path: Path) -> None:
    import scipy.sparse

    matrix = scipy.sparse.csc_matrix(np.eye(4))
    matrix.indices[2] = 10**6
    with pytest.raises(InputError, match="outside its shape"):
        load_untrusted(put(tmp_path, pickle.dumps(matrix)))


def test_shared_nesting_does_not_explode(tmp_path: Path) -> None:
    data: list = []
    for _ in range(60):
        data = [data, data]
    assert len(load_untrusted(put(tmp_path, pickle.dumps(data)))) == 2
    deep_key = handmade(b")" + b"2\x86" * 60 + b"K\x01\x86")  # hashing it would take 2**60 steps
    assert isinstance(load_untrusted(put(tmp_path, deep_key)), tuple)
    with pytest.raises(InputError):
        load_untrusted(put(tmp_path, handmade(b"}" + b")" + b"2\x86" * 60 + b"K\x01s")))


# damage ---------------------------------------------------------------------------------------------------------------
def samples(folder: Path) -> list[Path]:
    plain = put(folder, pickle.dumps({"poses": ARRAYS["float32"], "x": [1, "a"]}), "plain.pkl")
    np.savez(folder / "a.npz", poses=ARRAYS["float32"])
    np.save(folder / "a.npy", ARRAYS["float32"])
    packed = put(folder, zlib.compress(plain.read_bytes()), "packed.pkl")
    return [plain, folder / "a.npz", folder / "a.npy", packed]


def test_truncated_files_are_refused(tmp_path: Path) -> None:
    for path in samples(tmp_path):
        data = path.read_bytes()
        for length in [1, 2, 5, 11, *range(20, len(data) - 1, max(1, len(data) // 15))]:
            with pytest.raises(InputError) as caught:
                load_untrusted(put(tmp_path, data[:length], "cut" + path.suffix))
            assert "Traceback" not in str(caught.value)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_files_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.mktemp("damage")
    path = data.draw(st.sampled_from(samples(folder)))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    with suppress(InputError):
        load_untrusted(put(folder, bytes(content)))


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=200))
def test_garbage_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    folder = tmp_path_factory.mktemp("garbage")
    for head in (b"", b"\x80\x04", b"PK\x03\x04", b"\x93NUMPY\x01\x00", b"\x78\x9c", b"\x1f\x8b"):
        with suppress(InputError):
            load_untrusted(put(folder, head + data))


def test_missing_empty_and_foreign_files_say_what_is_wrong(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "program.pt", "w") as archive:
        for name in ("data.pkl", "constants.pkl", "code/__torch__.py"):
            archive.writestr(f"program/{name}", b"\x80\x02N.")
    for path, sentence in (
        (tmp_path / "nowhere.pkl", "no such file"),
        (tmp_path, "cannot be read"),
        (put(tmp_path, b"", "empty.pkl"), "empty"),
        (put(tmp_path, b"\x04\x22\x4d\x18abc", "lz4.pkl"), "LZ4"),
        (put(tmp_path, b"ZF0x10", "old.pkl"), "joblib before"),
        (tmp_path / "program.pt", "TorchScript"),
    ):
        with pytest.raises(InputError, match=sentence):
            load_untrusted(path)


def test_the_real_files_are_read(shared_data: Path) -> None:
    people = load_untrusted(shared_data / "priors" / "demo_jumpingjacks.pkl")
    assert next(iter(people.values()))["smpl"][0]["body_pose"].shape == (23, 3, 3)
    reconstruction = load_untrusted(shared_data / "priors" / "gvhmr_hmr4d_results.pt")
    assert reconstruction["smpl_params_incam"]["body_pose"].shape == (264, 63)


def test_the_real_files_agree_with_joblib_and_torch(shared_data: Path) -> None:
    joblib, torch = pytest.importorskip("joblib"), pytest.importorskip("torch")
    path = shared_data / "priors" / "demo_walk_1.pkl"
    found, expected = load_untrusted(path), joblib.load(path)
    assert same(found, expected)
    path = shared_data / "priors" / "gvhmr_hmr4d_results.pt"
    found, expected = load_untrusted(path), torch.load(path, weights_only=True)
    assert np.array_equal(found["smpl_params_incam"]["body_pose"], expected["smpl_params_incam"]["body_pose"].numpy())


def test_both_refusals_are_exceptions_of_their_own() -> None:
    assert not issubclass(Forbidden, Damaged) and not issubclass(Damaged, Forbidden)
