"""Words by which the columns of a table are known: quantities, units, and what is no position."""

from __future__ import annotations

from typing import Final


def words(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


def _words(meaning: str, words: str) -> dict[str, str]:
    return dict.fromkeys(words.split(), meaning)


ROOTS: Final[dict[str, str]] = {
    **_words("t", "t time timestamp datetime seconds zeit zeitstempel uhrzeit temps horodatage"),
    **_words("t", "tiempo tempo tijd marcatempo"),
    **_words("date", "date datum fecha"),
    **_words("frame", "frame frames framenumber frameno frameid frameindex frameidx framenum"),
    **_words("frame", "bild bildnummer bildnr trame fotograma fotogramma cuadro quadro slice"),
    **_words("x", "x posx xpos cx xc"),
    **_words("y", "y posy ypos cy yc"),
    **_words("z", "z posz zpos cz zc"),
    **{part: part for part in ("qx", "qy", "qz", "qw")},
    **_words("theta", "theta heading orientation angle yaw winkel ausrichtung orientierung"),
    **_words("theta", "orientierungswinkel drehwinkel ángulo angulo orientación orientacion"),
    **_words("theta", "angolo orientamento θ"),
    **_words("body", "body id track trackid robot robotid individual animal name particle agent"),
    **_words("body", "subject fish mouse rat bot particleid agentid objectid tagid uid tracklet"),
    **_words("body", "trackingid identity trajectory spur körper koerper roboter tier piste corps"),
    **_words("body", "individu trajectoire cuerpo pista trayectoria individuo corpo traccia"),
    **_words("body", "traiettoria instanceid"),
    **_words("lon", "lon lng long longitude longitud longitudine länge laenge"),
    **_words("lat", "lat latitude latitud latitudine"),
    **_words("confidence", "p conf confidence likelihood prob probability score valid visible"),
    **_words("confidence", "visibility certainty konfidenz confiance confianza confidenza"),
    **_words("confidence", "quality isvalid isvisible detected tracked"),
}
WITH_ID: Final = words("object obj cell marker tag target blob instance tracking")
"""These name bodies only with "id": alone they may be a class or a state, which changes."""
UNITS: Final[dict[str, str]] = {
    **{unit: unit for unit in words("m cm mm um km dm nm ft in yd s ds cs ms us ns min h d px")},
    **{unit: unit for unit in words("rad mrad deg gon turn ddeg cdeg")},
    **{"µm": "um", "μm": "um", "µs": "us", "μs": "us", "°": "deg", "deg/10": "ddeg"},
    **_words("m", "metre metres meter meters metri metro metros mètre mètres"),
    **_words("cm", "centimetre centimetres centimeter centimeters zentimeter"),
    **_words("mm", "millimetre millimetres millimeter millimeters"),
    **_words("um", "micron microns micrometer micrometers micrometre micrometres mikrometer"),
    **_words("px", "pix pixel pixels pixeles"),
    **_words("ft", "foot feet"),
    **_words("in", "inch inches zoll"),
    **_words("yd", "yard yards"),
    **_words("s", "sec secs second seconds sekunde sekunden seconde secondes segundos secondi"),
    **_words("ds", "decisecond deciseconds"),
    **_words("cs", "centisecond centiseconds"),
    **_words("ms", "msec millis milliseconds millisekunden"),
    **_words("us", "usec micros microseconds"),
    **_words("ns", "nsec nsecs nanosec nanosecs nanoseconds"),
    **_words("min", "mins minute minutes minuten minutos minuti"),
    **_words("h", "hr hrs hour hours stunden heures horas ore"),
    **_words("d", "day days tage jours días dias giorni"),
    **_words("rad", "radian radians"),
    **_words("deg", "degree degrees grados gradi degrés degres"),
    **_words("turn", "turns rev revs revolution revolutions"),
    **_words("gon", "gons gradian gradians"),
    **_words("ddeg", "decideg decidegree decidegrees deg10"),
    **_words("cdeg", "centideg centidegree centidegrees"),
}
LENGTHS: Final = words("m cm mm um km dm nm ft in yd px")
ALLOWED: Final[dict[str, frozenset[str]]] = {
    "t": words("s ds cs ms us ns min h d"),
    **dict.fromkeys(("x", "y", "z", "x1", "y1", "x2", "y2", "w", "h"), LENGTHS),
    "theta": words("rad mrad deg gon turn ddeg cdeg"),
    **dict.fromkeys(("lon", "lat"), frozenset({"deg"})),
    **dict.fromkeys(("date", "frame", "qx", "qy", "qz", "qw", "body", "confidence"), frozenset()),
}
"""Quantities, and the units that each may have."""
NO_UNIT: Final = words(
    "bl norm normed normalized normalised rel pct percent % grid cell cells tile tiles au "
    "unit units arb mil mils thou mi mile miles nmi fathom fathoms furlong furlongs grad "
    "voxel voxels ly pc steps ticks counts ratio frac fraction"
)
"""Units without a length or an angle of their own, or with several: they are refused by name."""

INNER: Final = words("mm cm um µm μm nm dm px pixel pixels deg degrees rad mrad")
"""Units that never name a body: they also count in the middle of a name (x_mm_filtered)."""

IMAGE_WORDS: Final = words(
    "is p pos posn position center centre centroid image coord coordinate mitte schwerpunkt "
    "mittelpunkt posición posicion centro posizione centroide"
)
"""Words next to x or y that name no body. They hint at an image: such lengths are not metres."""
NO_POSITION: Final = words(
    "velocity vel speed acceleration acc accel force err error std sigma var variance min max "
    "confidence likelihood score dot ddot gyro gyroscope mag magnetometer accelerometer rate "
    "omega angular linear twist torque jerk cov covariance bias noise diff delta gradient "
    "geschwindigkeit vitesse velocidad velocità kraft per"
)
"""Words next to a coordinate or an angle that rule out a position."""
DIRECTIONS: Final = words("dir direction euler rotations normal")
"""Words next to x, y or z without a unit that make it a part of a direction."""
SETPOINTS: Final = words(
    "ref reference cmd command commanded goal target tgt setpoint setp sp desired des demand "
    "origin wind current waypoint wp offset soll sollwert consigne consigna expected planned "
    "nominal joy joystick touch cursor"
)
"""Words of pairs that are not a body if there is another pair: setpoints, and what moves it."""
VARIANTS: Final = words(
    "raw filt filtered smooth smoothed est estimate estimated true truth gt meas measured "
    "pred predicted kf ekf interp interpolated corrected mean hat odom odometry gps imu "
    "cam world screen img global local"
)
"""Words of pairs that repeat a body, from before or after processing."""
TIME_WORDS: Final = words(
    "number no index stamp col num n° nr n trial recording elapsed video date ros unix epoch "
    "system relative simulation sim of day"
)
"""Words next to a time, a frame or a name that do not change what it is."""
FRONT: Final = words("head nose snout front kopf nase tête tete nez cabeza nariz testa")
REAR: Final = words("tail rear back tailbase schwanz queue cola coda")
MIDDLE: Final = words("body center centre centroid middle mid") | {""}
"""Parts of one body: its orientation is the direction from the middle to the front."""

_CORNERS: Final = {
    "x1": "xmin minx left bbleft bboxleft boxleft xtl tlx xul ulx x1 xleft",
    "y1": "ymin miny top bbtop bboxtop boxtop ytl tly yul uly y1 ytop",
    "x2": "xmax maxx right bbright bboxright boxright xbr brx xlr lrx x2 xright",
    "y2": "ymax maxy bottom bbbottom bboxbottom boxbottom ybr bry ylr lry y2 ybottom",
    "w": "w width bbwidth bboxwidth boxwidth breite largeur ancho larghezza",
    "h": "h height bbheight bboxheight boxheight höhe hoehe hauteur alto altezza",
    "x": "x",
    "y": "y",
}
BOXES: Final = {word: side for side, words in _CORNERS.items() for word in words.split()} | {
    f"{prefix}{side}": side for prefix in ("bbox", "bb", "box") for side in _CORNERS
}
"""From the name of a column, without separators and unit, to the side of a box that it holds."""
