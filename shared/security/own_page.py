"""Which requests of a browser are of a page that this computer served itself."""

from __future__ import annotations

import logging
from collections.abc import Collection
from typing import Final

from websockets.datastructures import Headers

LOOPBACK: Final = frozenset({"127.0.0.1", "localhost"})
# Who may show a page within its own: the page to drive from frames a view, strangers none.
FRAMED_BY: Final = "frame-ancestors 'self' http://127.0.0.1:* http://localhost:*"
# Where a page's server says what went wrong with a request, such as a connection that a browser
# opened in advance and never used: nowhere. A reader of the terminal would get a traceback.
UNHEARD: Final = logging.Logger("unheard")  # known to nobody who configures loggers
UNHEARD.addHandler(logging.NullHandler())


def is_of_own_page(headers: Headers, names: Collection[str] = ()) -> bool:
    """Whether a request is of the page that it asks for, or of no page.

    A stranger's page that is open in a browser can open connections to this computer; the browser
    then says whose page that is (`Origin`, RFC 6454 section 7). A stranger's name that leads here
    stands in `Host`. The port may be another one than the server's, if that was forwarded.

    The page is found at computers of these names; of none: at any.
    """
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) != 1 or len(origins) > 1:
        return False
    is_here = not names or hosts[0].partition(":")[0] in names
    return is_here and all(origin == f"http://{hosts[0]}" for origin in origins)
