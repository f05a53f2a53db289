"""Tables of readings and of end poses are read, and mistakes in them have one message."""

import numpy as np
import pytest

from realitygap.errors import LogError
from realitygap.logs import TableMap, read_range_table
from tests.logs.made import write_sample


def cells(n_distances=3, n_bearings=4, n_sensors=2):
    return np.random.default_rng(0).random((n_distances, n_bearings, n_sensors)).round(4)


def test_sample_gives_places_and_readings(tmp_path):
    made = cells()
    table = read_range_table(write_sample(tmp_path / "wall.sample", made, 5, 2))
    assert table.n_sensors == 2
    assert sorted(set(table.distance.round(6))) == [0.005, 0.007, 0.009]
    assert np.degrees(np.unique(table.bearing)) == pytest.approx([0, 90, 180, 270])
    at = (table.sensor == 1) & (table.distance == table.distance.max()) & np.isclose(table.bearing, np.pi / 2)
    assert table.readings[at] == pytest.approx([made[2, 1, 1]])
    assert (table.measured_from, table.bearing_from, table.clockwise) == (None, None, None)
    mapped = read_range_table(tmp_path / "wall.sample", TableMap(measured_from="body", bearing_from="sensor"))
    assert (mapped.measured_from, mapped.bearing_from) == ("body", "sensor")


def test_scaled_readings_become_shares(tmp_path):
    for full in (255, 1023, 4095):
        scaled = np.round(cells() * full)
        path = write_sample(tmp_path / "wall.sample", scaled, 5, 2, "{:.0f}")
        found = read_range_table(path)
        assert found.readings.max() <= 1
        assert found.readings == pytest.approx(scaled.ravel() / full)
        assert f"{full} is taken for the full scale" in found.notes[0]
    assert read_range_table(path, TableMap(full=8190)).readings.max() < 0.51
    inverted = read_range_table(path, TableMap(inverted=True)).readings
    assert inverted == pytest.approx(1 - scaled.ravel() / 4095)


def test_text_tables_have_one_reading_or_all_in_a_row(tmp_path):
    path = tmp_path / "wall.csv"
    path.write_text("distance_mm,bearing_deg,ir0,ir1\n10,0,0.5,0.25\n20,90,0.125,0\n", "utf-8")
    wide = read_range_table(path)
    path.write_text(
        "sensor,distance_mm,bearing_deg,reading\n0,10,0,0.5\n1,10,0,0.25\n0,20,90,0.125\n1,20,90,0\n", "utf-8"
    )
    long = read_range_table(path)
    for table in (wide, long):
        assert table.sensor.tolist() == [0, 1, 0, 1]
        assert table.distance == pytest.approx([0.01, 0.01, 0.02, 0.02])
        assert np.degrees(table.bearing) == pytest.approx([0, 0, 90, 90])
        assert table.readings.tolist() == [0.5, 0.25, 0.125, 0]
    path.write_text("distance_cm,value\n1,0.5\n2,0.25\n", "utf-8")
    assert read_range_table(path).measured_from == "sensor"
    path.write_text("0.01 1 7\n0.02 0.5 7\n", "utf-8")
    columns = {"distance": 1, "sensors": [2]}
    assert read_range_table(path, TableMap(columns=columns)).readings.tolist() == [1, 0.5]


def test_damaged_tables_have_one_message(tmp_path):
    path = write_sample(tmp_path / "wall.sample", cells(), 5, 2)
    whole = path.read_text("ascii")
    wrong = {
        whole[: len(whole) // 2]: "Is it cut off?",
        whole.replace("2 4 3 5 2", "3 4 3 5 2"): "has 8 numbers, expected 4 rows of 3",
        whole.replace("2 4 3 5 2", "2 4 4 5 2"): "has 3 blocks TURN, and its first line says 4 distances",
        whole.replace("2 4 3 5 2", "2.5 4 3 5 2"): "expected the numbers of sensors, bearings and distances",
        whole.replace("\n0.", "\nx.", 1): "a cell that is no number",
        "a,b\n1,2\n": "do not say which are distance and readings: a, b",
        "distance,reading\n-1,0.5\n": "a distance is -1 m",
        "distance,reading\n1,-0.5\n": "readings go from -0.5 to -0.5, expected 0 to 1",
        "distance,reading\n1,\n": "row 1 has no number in reading",
        "distance_mm,bearing_deg,sensor,reading\n1,0,0.5,1\n": "expected whole numbers from 0",
    }
    for text, message in wrong.items():
        path.write_text(text, "ascii")
        with pytest.raises(LogError) as error:
            read_range_table(path)
        assert message in str(error.value), message
        assert "\n" not in str(error.value)
