"""From one flight through all photos to sorties that are flown, certified and within limits."""

from dataclasses import dataclass, field

import numpy as np

from planner.airspace.space import Space
from planner.config import FlightSettings, SortieSettings
from planner.errors import Unattainable
from planner.flight.fly import Flight, plan_flight
from planner.flight.limits import Limits
from planner.flight.profile import rest_to_rest
from planner.flight.timing import SHORTEST, Timeline, fly_in_time
from planner.geometry.arrays import Floats, Ints
from planner.route.ways import FreeWays
from planner.sorties.choose import choose_sorties
from planner.sorties.problem import TIE, SortieProblem, Split
from planner.sorties.refusals import refuse_waypoints, too_far, too_winding, unreachable
from planner.sorties.shared import linked
from planner.sorties.sortie import Sortie, stops_of, timed_sortie
from planner.sorties.sorties import Sorties
from planner.sorties.station import Station
from planner.sorties.thought import straight_legs, straight_seconds, usable_seconds
from planner.viewpoints.viewpoints import Viewpoints

PATIENCE = 12
"""Cuts that are flown to find their true times before others are thought to be as much slower."""

MOST_ROUNDS = 100
"""Cuts that are flown at most."""

Key = tuple[int, tuple[int, ...]]


def plan_sorties(
    flight: Flight,
    timeline: Timeline,
    stations: tuple[Station, ...],
    airspace: Space,
    edges: Ints,
    *,
    settings: SortieSettings,
    flight_settings: FlightSettings,
    seed: int,
) -> Sorties:
    """Cut a flight into sorties, each of which is flown, certified, and within its limits.

    Times of legs are those of the certified flight. Each cut that is chosen is flown: the way
    from the station, the photos with those it shares, the way back. Where that takes another
    time than was thought, or breaks a limit, the true time counts, and the cut is chosen
    again, until all of its times are true.

    Parameters
    ----------
    flight, timeline
        All photos in order, and their times.
    stations
        Places of take-off and landing.
    airspace
        Solids and zones.
    edges
        Pairs of photos that match, shape (E, 2), numbered as ``flight`` does.
    settings
        Limits and method.
    flight_settings
        How legs are flown.
    seed
        Root of the motion solver's chance.

    Raises
    ------
    Unattainable
        If a photo cannot be taken within the limits; the message names what is missing.

    """
    book = _Book(flight, timeline, stations, airspace, edges, settings, flight_settings, seed)
    count = len(flight.viewpoints)
    book.refuse_photos_out_of_reach()
    given = book.cut(np.arange(count))
    seconds = {"split": given.cost}
    chosen, order = book, np.arange(count)
    if settings.method != "split" and count > 2:
        found = choose_sorties(
            book.problem,
            np.arange(count),
            method="routing",
            known=book.times(),
            solutions=settings.iterations,
        )
        better = found is not None and found.cost < given.cost - TIE
        if found is not None and (better or settings.method == "routing"):
            other = book.reordered(found.order)
            routed = None if other is None else other.cut(np.arange(count))
            if other is not None and routed is not None:
                seconds["routing"] = routed.cost
                if settings.method == "routing" or routed.cost < given.cost - TIE:
                    chosen, given, order = other, routed, found.order
    return Sorties(
        stations,
        tuple(chosen.flown[key] for key in _keys(given)),
        chosen.flight,
        chosen.timeline,
        order,
        "split" if chosen is book else "routing",
        seconds,
        chosen.rounds,
        chosen.rounds <= PATIENCE,
    )


def _keys(split: Split) -> list[Key]:
    return [
        (home, tuple(photos.tolist()))
        for home, photos in zip(split.stations, split.sorties, strict=True)
    ]


@dataclass(eq=False)
class _Book:
    """What is known of the sorties through the photos of one flight."""

    flight: Flight
    timeline: Timeline
    stations: tuple[Station, ...]
    airspace: Space
    edges: Ints
    settings: SortieSettings
    flight_settings: FlightSettings
    seed: int
    known: dict[Key, float] = field(default_factory=dict)
    flown: dict[Key, Sortie] = field(default_factory=dict)
    ways: FreeWays | None = None
    sharing: list[Key] = field(default_factory=list)
    rows: dict[Key, Ints] = field(default_factory=dict)
    slower: float = 0.0
    fuller: int = 0
    bold: bool = False
    rounds: int = 0

    def __post_init__(self) -> None:
        if self.ways is None:
            self.ways = FreeWays(self.airspace, margin=self.flight_settings.margin)
        views, path = self.viewpoints, self.flight.path
        count = len(views)
        self.legs, self.points = (
            straight_legs(views, self.limits),
            np.ones((count, count), np.int64),
        )
        done, depart = self.timeline.done[: count - 1], self.timeline.depart[: count - 1]
        pieces = np.bincount(path.leg, minlength=count)[: len(done)]
        here = np.arange(len(done))
        for a, b in ((here, here + 1), (here + 1, here)):
            self.legs[a, b], self.points[a, b] = done - depart, pieces
        entries = np.array([station.entry for station in self.stations])
        ways = np.linalg.norm(entries[:, None] - views.positions[None], axis=2)
        speeds = self.settings.climb_speed, self.limits.acceleration
        climbs = np.array([[rest_to_rest(station.climb, *speeds)] for station in self.stations])
        self.out = climbs + np.maximum(straight_seconds(ways, self.limits), SHORTEST)
        self.back = self.out.copy()
        if self.limits.stop:
            self.out = self.out + self.limits.settle_seconds
        self.out_points = np.ones(self.out.shape, dtype=np.int64)
        self.back_points = self.out_points.copy()

    @property
    def limits(self) -> Limits:
        """Limits of motion."""
        return self.timeline.limits

    @property
    def viewpoints(self) -> Viewpoints:
        """All photos, in the order of the flight."""
        return self.flight.viewpoints

    @property
    def problem(self) -> SortieProblem:
        """Times that are known or thought so far."""
        settings = self.settings
        return SortieProblem(
            self.legs,
            self.out + self.slower,
            self.back,
            self.points,
            self.out_points,
            self.back_points,
            usable_seconds(settings),
            None if settings.most_waypoints is None else settings.most_waypoints - self.fuller,
            settings.turnaround_seconds,
        )

    def refuse_photos_out_of_reach(self) -> None:
        """Raise if a photo alone takes too long, even straight there and back."""
        alone = (self.out + self.back).min(axis=0)
        worst = int(np.argmax(alone))
        if alone[worst] > usable_seconds(self.settings) + TIE:
            raise too_far(self.viewpoints.positions[worst], self._alone(worst), self.settings)
        refuse_waypoints(self.settings)

    def cut(self, order: Ints) -> Split:
        """Cut of an order whose sorties have all been flown and keep their limits.

        Sorties that are not flown yet are thought to take what their legs take, with the photos
        that they must share. That is hardly ever too much, so the cut is the optimum. If that
        takes too many cuts, they are thought to take as much longer as others did.
        """
        while True:
            split = choose_sorties(self.problem, order, method="split", known=self.times())
            if split is None:
                if not self.cautious:
                    raise self._no_cut(order)
                self.bold = True  # photos may only seem out of reach
                self.slower, self.fuller = 0.0, 0
                continue
            new = [key for key in _keys(split) if key not in self.known]
            if not new:
                return split
            if self._think(new):
                continue
            self.rounds += 1
            if self.rounds > MOST_ROUNDS:
                raise Unattainable(
                    f"sorties: after {MOST_ROUNDS} cuts some sortie still takes longer than "
                    "was thought; raise sorties.endurance_seconds"
                )
            for key in new:
                self._fly(key)

    @property
    def cautious(self) -> bool:
        """Whether sorties are thought to be slower than their legs, as others were."""
        return self.rounds > PATIENCE and not self.bold

    def times(self) -> dict[Key, float]:
        """True seconds of sorties that have been flown, and thought ones of others."""
        problem = self.problem
        thought = {
            (home, photos): problem.seconds(home, self.rows[home, photos])
            if problem.most is None
            or problem.waypoints(home, self.rows[home, photos]) <= problem.most
            else np.inf
            for home, photos in self.sharing
        }
        return {**thought, **self.known}

    def _think(self, keys: list[Key]) -> bool:
        """Look at which photos these sorties must share; whether that changes any of them."""
        changed = False
        for key in keys:
            if key in self.rows:
                continue
            photos = np.array(key[1], dtype=np.int64)
            rows = linked(photos, self.edges, self.legs) if self.settings.connected else photos
            self.rows[key] = rows
            if len(rows) > len(photos):
                changed = True
                self.sharing.append(key)
        return changed

    def reordered(self, order: Ints) -> "_Book | None":
        """Book of the same photos in another order; ``None`` if they cannot be flown so."""
        flight = plan_flight(
            self.viewpoints.take(order),
            self.airspace,
            settings=self.flight_settings,
            seed=self.seed,
            ways=self.ways,
        )
        if len(flight.kept) < len(order):
            return None
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        timeline = fly_in_time(flight.path, flight.viewpoints, self.limits)
        return _Book(
            flight,
            timeline,
            self.stations,
            self.airspace,
            place[self.edges],
            self.settings,
            self.flight_settings,
            self.seed,
            ways=self.ways,
        )

    def _fly(self, key: Key) -> None:
        """Fly one sortie, and note its true times."""
        home, photos, rows = key[0], np.array(key[1], dtype=np.int64), self.rows[key]
        flight = plan_flight(
            stops_of(self.viewpoints, rows, self.stations[home]),
            self.airspace,
            settings=self.flight_settings,
            seed=self.seed,
            ways=self.ways,
        )
        if len(flight.kept) < len(rows) + 2:
            self.known[key] = np.inf
            return
        sortie = timed_sortie(
            home,
            self.stations[home],
            self.viewpoints,
            flight.path,
            photos=rows,
            shared=np.setdiff1d(rows, photos),
            limits=self.limits,
            climb_speed=self.settings.climb_speed,
        )
        timeline, climb = sortie.timeline, sortie.climb_seconds
        self.out[home, rows[0]] = climb + timeline.done[0]
        self.back[home, rows[-1]] = climb + timeline.done[-1] - timeline.depart[-1]
        pieces = np.bincount(sortie.path.leg)
        self.out_points[home, rows[0]], self.back_points[home, rows[-1]] = pieces[[0, -1]]
        self._note(rows, timeline.done - timeline.depart, pieces)
        problem, most = self.problem, self.settings.most_waypoints
        fits = sortie.duration <= problem.endurance + TIE
        fits &= most is None or sortie.waypoints <= most
        self.known[key] = sortie.duration if fits else np.inf
        if self.cautious:
            late = sortie.duration - (problem.seconds(home, rows) - self.slower)
            self.slower = max(self.slower, late)
            self.fuller = max(self.fuller, sortie.waypoints - problem.waypoints(home, rows))
        self.flown[key] = sortie

    def _note(self, rows: Ints, seconds: Floats, pieces: Ints) -> None:
        """Note what legs take that the whole flight has not; they were only known from below."""
        before, after = rows[:-1], rows[1:]
        new = np.abs(after - before) != 1
        for a, b in ((before, after), (after, before)):
            self.legs[a[new], b[new]] = seconds[1:-1][new]
            self.points[a[new], b[new]] = pieces[1:-1][new]

    def _alone(self, photo: int) -> float:
        """True seconds of the fastest sortie of one photo; infinite without any safe way."""
        keys = [(home, (photo,)) for home in range(len(self.stations))]
        for key in keys:
            if key not in self.known:
                self._think([key])
                self._fly(key)
        return min((self.flown[key].duration for key in keys if key in self.flown), default=np.inf)

    def _no_cut(self, order: Ints) -> Unattainable:
        """Say what is missing where no cut keeps the limits: some photo alone breaks them."""
        worst = next(
            int(photo)
            for photo in order
            if all(
                self.known.get((home, (int(photo),)), 0.0) == np.inf
                or not self.problem.allows(home, np.array([photo]))
                for home in range(len(self.stations))
            )
        )
        seconds = self._alone(worst)
        spot = self.viewpoints.positions[worst]
        if np.isinf(seconds):
            return unreachable(spot)
        if seconds > usable_seconds(self.settings) + TIE:
            return too_far(spot, seconds, self.settings)
        needed = min(sortie.waypoints for key, sortie in self.flown.items() if key[1] == (worst,))
        return too_winding(spot, needed, self.settings)
