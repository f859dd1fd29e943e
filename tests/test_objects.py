"""Velocity, growth, time to contact, boxes and events, against drives whose truth is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ifsvideo.objects.boxes import point_box, steady_boxes
from ifsvideo.objects.contact import contact, stretch
from ifsvideo.objects.events import KINDS, Sights, events_of, over_edge
from ifsvideo.objects.history import ObjectHistory, ObjectTable
from ifsvideo.objects.kinematics import foot_step, steps, velocity
from ifsvideo.objects.margins import Margin
from ifsvideo.types import Scene

from .drives import FPS, HEIGHT, INFO, drive, history


def cloud(count: int = 40, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(100, 180, (count, 2))


class TestStretch:
    def test_growth_is_found_through_noise_and_strays(self):
        before = cloud()
        after = 1.03 * before + [5, -2] + np.random.default_rng(0).normal(0, 0.1, before.shape)
        after[:4] += [[9, 0], [-7, 3], [0, 12], [4, -8]]
        a, b, c, error = stretch(before, after)
        assert a == pytest.approx(math.log(1.03), abs=0.002)
        assert math.hypot(b, c) < 0.003
        assert 0 < error < 0.002

    def test_what_turns_grows_along_one_direction(self):
        a, b, c, _ = stretch(cloud(), cloud() * [1.04, 1.0])
        assert (a, b) == pytest.approx((math.log(1.04) / 2, math.log(1.04) / 2), rel=0.02)
        assert abs(c) < 1e-3

    def test_it_does_not_depend_on_place_or_turn(self):
        turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
        assert stretch(cloud() @ turn.T + 300, (1.02 * cloud()) @ turn.T)[0] == pytest.approx(math.log(1.02))

    @pytest.mark.parametrize("xy", [cloud(4), np.full((9, 2), 5.0), np.empty((0, 2))])
    def test_too_little_to_compare_gives_nothing(self, xy):
        assert np.isnan(stretch(xy, xy)).all()


class TestContact:
    def approach(self, contact_s: float, frames: int, noise: float = 0.0) -> np.ndarray:
        depth = contact_s - np.arange(frames) / FPS
        growth = np.diff(-np.log(depth), prepend=np.nan) + np.random.default_rng(2).normal(0, noise, frames)
        still = np.zeros(frames)
        return np.column_stack([growth, still, still, np.full(frames, max(noise, 1e-4))])

    def test_a_steady_approach_is_told_to_its_end(self):
        found = contact(self.approach(3.0, 60), FPS)
        true = 3.0 - np.arange(60) / FPS
        np.testing.assert_allclose(found.ttc_s[2:], true[2:], rtol=0.03)
        np.testing.assert_allclose(found.scale_rate * found.ttc_s, 1.0)
        assert (found.confidence[2:] > 0.9).all()

    def test_noise_alone_and_going_away_are_silent(self):
        still = np.random.default_rng(0).normal(0, 0.01, (200, 4))
        still[:, 3] = 0.01
        assert np.isfinite(contact(still, FPS).ttc_s).mean() < 0.03
        away = -self.approach(4.0, 50)
        away[:, 3] = 1e-3
        found = contact(away, FPS)
        assert np.isnan(found.ttc_s).all()
        assert (found.scale_rate[1:] < 0).all()

    def test_turning_alone_is_silent(self):
        turning = self.approach(3.0, 50)
        turning[:, 1] = turning[:, 0]
        assert np.isnan(contact(turning, FPS).ttc_s).all()

    def test_nothing_is_told_of_a_glimpse_or_across_a_gap(self):
        assert np.isnan(contact(self.approach(3.0, 5), FPS).scale_rate).all()
        broken = self.approach(3.0, 60)
        broken[30] = np.nan
        assert np.isfinite(contact(broken, FPS).ttc_s[31:]).all()


def test_velocity_is_against_the_background_around():
    own, around = np.tile([3.0, 1.0], (30, 1)), np.tile([-1.0, 1.0], (30, 1))
    own[0] = np.nan
    np.testing.assert_allclose(velocity(own, around, 25.0), np.tile([100.0, 0.0], (30, 1)), atol=1e-9)


def test_steps_are_those_of_the_nearest_ground():
    ground = np.array([[x, 100.0] for x in range(0, 600, 10)])
    moved = ground + np.where(ground[:, :1] < 300, [2.0, 0.0], [-2.0, 0.0])
    own, around = steps(np.full((3, 2), 90.0), np.full((3, 2), 95.0), ground, moved)
    assert (own.tolist(), around.tolist()) == ([5.0, 5.0], [2.0, 0.0])
    own, around = steps(ground[:2], ground[:2], ground[:7], moved[:7])
    assert np.isnan([*own, *around]).all()


def test_the_foot_is_measured_where_the_ground_is_as_far():
    after, box = np.array([[50.0, 80.0], [60.0, 90.0], [55.0, 85.0]]), np.array([45.0, 70.0, 65.0, 100.0])
    ground = np.array([[40.0, 98.0], [70.0, 101.0], [42.0, 99.0], [50.0, 20.0]])
    moved = ground + np.array([[0, 4], [0, 4], [0, 4], [0, 99]])
    # It grows by a tenth: its foot, 15 px below its middle, goes down 1.5 px more than that.
    found = foot_step(np.array([0.0, 1.0]), 0.1, after, box, ground, moved)
    assert found == pytest.approx(1.0 + 1.5 - 4.0)
    assert math.isnan(foot_step(np.zeros(2), 0.1, after, box, ground[3:], moved[3:]))


class TestBoxes:
    def test_a_stray_point_does_not_pull_the_box(self):
        xy = np.vstack([cloud(60), [[500.0, 20.0]]])
        left, top, right, bottom = point_box(xy, 734.0)
        assert 90 < left < 105
        assert 90 < top < 105
        assert 175 < right < 190
        assert 175 < bottom < 190

    def test_one_frame_s_mistake_is_outvoted_while_it_moves_and_grows(self):
        frames = np.arange(40)
        scale = np.exp(0.02 * frames)
        middle = 200.0 + 3.0 * frames
        boxes = np.column_stack(
            [middle - 20 * scale, 100 - 20 * scale, middle + 20 * scale, 100 + 20 * scale]
        )
        wrong = boxes.copy()
        wrong[20] += [-60, -60, 60, 60]
        own = np.tile([3.0, 0.0], (40, 1))
        own[0] = np.nan
        found = steady_boxes(wrong, own, np.full(40, 0.02), FPS, (640, 360))
        np.testing.assert_allclose(found, boxes, atol=0.01)

    def test_near_the_edge_it_reaches_the_edge(self):
        found = steady_boxes(
            np.array([[8.0, 50.0, 60.0, 352.0]]), np.full((1, 2), np.nan), [np.nan], FPS, (640, 360)
        )
        assert found.tolist() == [[-0.5, 50.0, 60.0, 359.5]]


def rows_near(table: ObjectTable, t: float) -> ObjectTable:
    return table.select(np.abs(table.time_s - t) < 0.3)


def kinds(scenes: list[Scene]) -> list[tuple[str, str]]:
    return [(event.kind, event.text) for event in history(scenes).events]


class TestDrives:
    def test_an_oncoming_car_is_seen_to_come_closer_and_to_leave(self):
        scenes = drive(lambda t: (-3.0, 75.0 - 12.0 * t, 0.0), seconds=4.0)
        found = history(scenes)
        rows = found.table.of(1)
        near = rows.select((rows.time_s > 1.0) & (rows.time_s < 2.8))
        # What is seen of it nearest is its front, two metres before its middle.
        np.testing.assert_allclose(near.ttc_s, (73.0 - 24.0 * near.time_s) / 24.0, rtol=0.2, atol=0.1)
        events = {event.kind: event for event in found.events}
        assert set(events) == {"appears", "comes closer fast", "leaves"}
        assert events["leaves"].text == "object 1 leaves on the left"
        assert events["comes closer fast"].time_s < 0.5

    def test_a_car_that_overtakes(self):
        scenes = drive(lambda t: (-3.2, -6.0 + 17.0 * t, 0.0))
        told = kinds(scenes)
        assert ("overtakes", "object 1 overtakes on the left") in told
        assert ("appears", "object 1 appears on the left") in told
        assert {kind for kind, _ in told} == {"appears", "overtakes"}

    def test_a_car_that_is_overtaken(self):
        told = kinds(drive(lambda t: (3.2, 18.0 + 6.0 * t, 0.0)))
        assert ("is overtaken", "object 1 is overtaken, on the right") in told
        assert ("leaves", "object 1 leaves on the right") in told
        assert "overtakes" not in {kind for kind, _ in told}

    def test_a_car_that_crosses_while_we_stand(self):
        told = kinds(drive(lambda t: (12.0 - 8.0 * t, 18.0, math.pi / 2), speed=0.0, seconds=3.2))
        assert ("crosses", "object 1 crosses from right to left") in told
        assert not {"overtakes", "is overtaken", "comes closer fast"} & {kind for kind, _ in told}

    def test_a_car_at_a_constant_gap_only_is_in_sight(self):
        scenes = drive(lambda t: (0.3, 15.0 + 12.0 * t, 0.0))
        assert kinds(scenes) == [("appears", "object 1 is in sight at the beginning")]
        rows = history(scenes).table.of(1)
        assert np.isnan(rows.ttc_s).all()
        assert np.nanmax(np.abs(rows.scale_rate)) < 0.05

    def test_a_car_behind_something_is_hidden_and_comes_again(self):
        scenes = drive(lambda t: (0.0, 20.0 + 12.0 * t, 0.0), hidden=lambda t: 1.5 < t < 2.6)
        assert [kind for kind, _ in kinds(scenes)] == ["appears", "is hidden", "appears"]
        events = history(scenes).events
        assert [event.time_s for event in events] == pytest.approx([0.0, 1.48, 2.6], abs=0.05)
        assert events[2].text == "object 1 appears again"

    def test_a_cut_is_no_event_of_an_object(self):
        first = drive(lambda t: (0.0, 20.0 + 12.0 * t, 0.0), seconds=1.5)
        second = drive(lambda t: (1.0, 18.0 + 12.0 * t, 0.0), seconds=1.5)
        moved = [
            replace(
                scene,
                frame=scene.frame + len(first),
                time_s=INFO.time_of(scene.frame + len(first)),
                ids=scene.ids + 1_000_000,
                labels=2 * scene.labels,
            )
            for scene in second
        ]
        told = history([*first, *moved]).events
        assert [(event.time_s, event.text) for event in told] == [
            (0.0, "object 1 is in sight at the beginning"),
            (1.52, "object 2 is in sight at the beginning of a shot"),
        ]

    def test_a_car_that_stops_and_starts(self):
        where = lambda t: (2.0, 70.0 + 6.0 * max(0.0, min(t, 3.5) - 1.0), 0.0)  # noqa: E731
        told = history(drive(where, seconds=5.0, label=lambda t: int(1.0 < t < 3.5))).events
        assert [event.text for event in told] == [
            "object 1 starts to move",
            "object 1 stops: its points stand still with the background",
        ]
        assert [event.time_s for event in told] == pytest.approx([1.0, 3.5], abs=0.1)

    def test_what_is_known_late_is_told_of_the_time_since_which_it_is_in_sight(self):
        told = history(
            drive(lambda t: (-3.0, 60.0 - 8.0 * t, 0.0), label=lambda t: int(0.7 < t < 2.3), seconds=4.0)
        ).events
        assert [event.kind for event in told] == ["appears", "comes closer fast", "leaves"]
        assert told[0].text == "object 1 is in sight at the beginning"
        assert told[1].text in [f"object 1 comes closer fast: contact in {t} s" for t in (2.8, 2.9, 3.0)]
        assert [event.time_s for event in told] == pytest.approx([0.0, 0.0, 2.87], abs=0.1)

    def test_what_stood_before_is_not_said_to_come_closer_since_then(self):
        where = lambda t: (-2.0, 70.0 - 14.0 * max(0.0, t - 1.2) ** 2, 0.0)  # noqa: E731
        told = history(drive(where, seconds=2.8, label=lambda t: int(t > 1.3), speed=3.0)).events
        assert [event.kind for event in told][:2] == ["appears", "comes closer fast"]
        assert told[0].text == "object 1 starts to move"
        assert told[1].time_s > 1.7

    @pytest.mark.parametrize(
        ("measured_s", "since"), [([4.0], 5), ([5.0], 5), ([5.6], 20), ([4.0] * 3 + [6.1] + [4.0] * 6, 14)]
    )
    def test_growth_that_seems_up_to_half_as_fast_does_not_deny_that_contact_was_near(
        self, measured_s: list[float], since: int
    ):
        """Contact is at 80 frames of 25 a second; what is measured before the 20th is too long."""
        frame = np.arange(60, dtype=np.int32)
        ttc = (80 - frame) / 25.0
        ttc[:10], ttc[10:20] = np.nan, measured_s
        ones, unknown = np.ones(60, np.int32), np.full(60, np.nan)
        box = np.repeat(np.array([[200], [100], [40], [30], [220], [115], [0], [0]], np.float32), 60, axis=1)
        nearing = np.array([1 / ttc, ttc, np.isfinite(ttc)], np.float32)
        rows = ObjectTable(frame, frame / 25.0, ones, 9 * ones, *box, *nearing)
        sights = Sights(rows, unknown, unknown, Margin(), Margin(), again=False, shot=(0, 60))
        told = {event.kind: event.frame for event in events_of(sights, INFO)}
        assert told["comes closer fast"] == pytest.approx(since, abs=1)

    def test_what_comes_in_too_fast_to_be_noticed_came_over_the_edge(self):
        told = history(
            drive(lambda t: (-16.0 + 10.0 * t, 18.0, math.pi / 2), speed=0.0, hidden=lambda t: t < 0.9)
        ).events
        assert [event.text for event in told] == [
            "object 1 appears on the left",
            "object 1 crosses from left to right",
            "object 1 leaves on the right",
        ]
        assert told[0].time_s == pytest.approx(0.65, abs=0.15), "when it was wholly in the picture"

    def test_what_stood_and_is_carried_out_of_the_picture_left_it(self):
        rows = history(drive(lambda t: (-1.5, 12.0, 0.0), speed=0.0, seconds=0.4, noise=0)).table.of(1)
        still = replace(rows, cx=np.full_like(rows.cx, rows.cx[0]))
        assert over_edge(still, 1, np.array([-400.0, 0.0]), INFO) == (0, "left")
        assert over_edge(still, 1, np.zeros(2), INFO) == (0, None)

    def test_a_car_that_crosses_while_we_drive_is_not_overtaken(self):
        told = kinds(drive(lambda t: (-14.0 + 9.5 * t, 26.0, math.pi / 2), speed=3.0))
        assert [kind for kind, _ in told] == ["appears", "crosses", "leaves"]

    def test_another_number_for_the_same_tracks_is_no_event(self):
        told = kinds(drive(lambda t: (0.3, 15.0 + 12.0 * t, 0.0), label=lambda t: 1 if t < 2 else 2))
        assert told == [("appears", "object 1 is in sight at the beginning")]

    def test_a_label_that_is_lost_while_the_tracks_go_on_is_no_event(self):
        told = kinds(drive(lambda t: (0.3, 15.0 + 12.0 * t, 0.0), label=lambda t: int(not 1.5 < t < 2.3)))
        assert told == [("appears", "object 1 is in sight at the beginning")]

    def test_every_kind_of_event_is_known(self):
        told = drive(lambda t: (-3.0, 75.0 - 12.0 * t, 0.0)), drive(lambda t: (3.2, 18.0 + 6.0 * t, 0.0))
        assert {kind for scenes in told for kind, _ in kinds(scenes)} <= set(KINDS)


class TestHistory:
    def test_a_clip_without_an_object_gives_an_empty_table(self):
        found = history(drive(lambda t: (0.0, 20.0, 0.0), seconds=0.4, label=lambda t: 0))
        assert (len(found.table), found.events, found.table.numbers) == (0, (), [])

    def test_objects_seen_in_one_frame_only_have_a_row(self):
        found = history(drive(lambda t: (0.0, 15.0, 0.0), seconds=0.04))
        assert len(found.table) == 1
        assert np.isnan(found.table.vx).all()

    def test_the_box_holds_the_object(self):
        rows = rows_near(history(drive(lambda t: (0.0, 15.0 + 12.0 * t, 0.0))).table, 2.0)
        # The near end stands 13 m ahead: 1.8 m wide there.
        np.testing.assert_allclose(rows.width, 1.8 * 500 / 13, rtol=0.15)
        np.testing.assert_allclose(rows.cx, 319.5, atol=3)
        np.testing.assert_allclose(rows.top + rows.height, 150 + HEIGHT * 500 / 13, atol=8)

    def test_thumbnails_are_of_the_frame_in_which_it_is_largest(self):
        found = ObjectHistory(INFO, thumbnails=True)
        assert found.wants_image
        for scene in drive(lambda t: (0.0, 40.0 - 10.0 * t, 0.0), seconds=2.0, speed=0.0):
            found.add(scene, np.full((360, 640, 3), 4 * scene.frame, np.uint8))
        found.finish()
        picture = found.thumbnails[1]
        assert max(picture.shape[:2]) <= 160
        assert picture[0, 0, 0] > 4 * 44
