"""Transcripts: what was recorded comes back, and any departure from it is named by line."""

import json

import pytest
from instruments.wire import Script
from worlds.full_disk import files_end_at

from daq.errors import BenchTimeout, FileFormatError, ProtocolError
from daq.transports.base import Deadline, ask, ask_block
from daq.transports.transcript import Recorder, Replay

SOON = Deadline.after(24 * 3600.0)
# Made when the tests are collected, and good for as long as a whole run may take.
DIALOGUE = "> A 1\n> B?\n< +5\n> C?\n# 1.5 -2\n= 96\n! clear\n! drops only\n= none"


class Moody(Script):
    def read(self, deadline):
        reply = super().read(deadline)
        if reply == "TIMEOUT":
            raise BenchTimeout("'Q?' got no answer")
        return reply


def play(transport) -> list:
    transport.write("A 1", SOON)
    return [
        ask(transport, "B?", SOON),
        ask_block(transport, "C?", SOON),
        transport.serial_poll(SOON),
        transport.device_clear(SOON),
        transport.device_clear(SOON),
        transport.serial_poll(SOON),
    ]


@pytest.fixture
def recorded(tmp_path):
    path = tmp_path / "run.jsonl"
    script = Script(DIALOGUE)
    recorder = Recorder(script, path)
    answers = play(recorder)
    recorder.close()
    assert script.closed
    return path, answers


def test_recorded_dialogue_replays_identically(recorded):
    path, answers = recorded
    replay = Replay(path)
    assert play(replay) == answers
    assert replay.unused == 0
    assert answers[2:] == [96, True, False, None]


def test_every_act_is_on_disk_before_return(tmp_path):
    path = tmp_path / "run.jsonl"
    recorder = Recorder(Script("> A 1\n> B?\n< +5"), path)
    recorder.write("A 1", SOON)
    assert json.loads(path.read_text().splitlines()[-1])["line"] == "A 1"
    recorder.write("B?", SOON)
    recorder.read(SOON)
    assert json.loads(path.read_text().splitlines()[-1])["gave"] == "+5"
    recorder.close()


def test_errors_are_recorded_and_replayed_as_errors(tmp_path):
    path = tmp_path / "run.jsonl"
    recorder = Recorder(Moody("> Q?\n< TIMEOUT\n! clear"), path)
    for transport in (recorder, Replay):
        if transport is Replay:
            recorder.close()
            transport = Replay(path)
        with pytest.raises(BenchTimeout, match="'Q\\?' got no answer"):
            ask(transport, "Q?", SOON)
        assert transport.device_clear(SOON)


def test_full_disk_ends_transcript_not_dialogue(tmp_path):
    told, script, path = [], Script(DIALOGUE), tmp_path / "run.jsonl"
    recorder = Recorder(script, path, told.append)
    recorder.write("A 1", SOON)
    with files_end_at(path.stat().st_size):
        assert ask(recorder, "B?", SOON) == "+5"
    (line,) = told
    assert "run.jsonl: the transcript ends after 1 acts (File too large)" in line
    assert ask_block(recorder, "C?", SOON)
    recorder.close()
    assert script.closed
    assert len(told) == 1
    assert Replay(tmp_path / "run.jsonl").unused == 1


def test_mismatch_names_line_and_both_sides(recorded):
    replay = Replay(recorded[0])
    replay.write("A 1", SOON)
    with pytest.raises(ProtocolError) as error:
        replay.write("B 2", SOON)
    assert "line 3: the recording has write 'B?', the dialogue has write 'B 2'" in str(error.value)
    with pytest.raises(ProtocolError, match="line 3: the recording has write 'B\\?', .* has poll"):
        replay.serial_poll(SOON)


def test_the_end_of_a_recording_is_named(recorded):
    replay = Replay(recorded[0])
    play(replay)
    with pytest.raises(ProtocolError, match="ends after 9 acts, .* goes on with read"):
        replay.read(SOON)


def test_a_replay_does_not_wait(recorded):
    Replay(recorded[0]).pause(1e9)


def test_truncated_last_line_is_omitted(recorded):
    path, _ = recorded
    whole = path.read_text()
    path.write_text(whole[:-10])
    assert Replay(path).unused == 8


@pytest.mark.parametrize(
    ("number", "line", "fault"),
    [
        (1, '{"transcript": 2}', 'should hold "transcript": 1'),
        (1, "[]", "line 1: is not a JSON object"),
        (2, "{not json}", "line 2: is not JSON"),
        (2, '{"act": "shout"}', "line 2: holds no act"),
        (2, '{"act": "write"}', "line 2: holds no act"),
        (3, '{"act": "read", "line": "X"}', "line 3: holds no act"),
        (4, '{"act": "read", "gave": 5}', "line 4: holds no answer to a read"),
        (4, '{"act": "read"}', "line 4: holds no answer to a read"),
        (4, '{"act": "block", "base64": "%%"}', "line 4: holds no block"),
        (4, '{"act": "block"}', "line 4: holds no block"),
        (4, '{"act": "read", "raised": "SystemExit", "message": "x"}', "holds no error"),
        (4, '{"act": "read", "raised": "LinkError"}', "holds no error"),
    ],
)
def test_a_damaged_transcript_is_refused_whole(recorded, number, line, fault):
    path, _ = recorded
    lines = path.read_text().splitlines()
    lines[number - 1] = line
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(FileFormatError, match=fault):
        Replay(path)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"frequency_hz,gain\n"])
def test_invalid_transcript_is_refused(tmp_path, content):
    path = tmp_path / "other"
    path.write_bytes(content)
    with pytest.raises(FileFormatError):
        Replay(path)
