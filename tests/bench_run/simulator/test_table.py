import pytest

from planner.bench_run.simulator.table import Table
from tests.bench_run.memory_line import VirtualClock

READY = ":Interlock:Reset ALL;:Interlock:Close ALL"


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def table(clock):
    return Table(clock, 2, travel=[None, (-100.0, 100.0)])


def ecp(table, axis=1):
    return table.receive(f":Status:ECP? {axis}")


@pytest.mark.parametrize(
    ("messages", "code"),
    [
        ([":Mode:Position 1"], "3"),
        ([":Interlock:Close ALL"], "3"),
        ([READY, ":Demand:Position 1,90"], "4"),
        ([READY, ":Mode:Rate 1;:Demand:Position 1,90"], "4"),
        ([READY, ":Limit:Rate r,1,100;:Mode:Rate 1;:Demand:Rate 1,100.1"], "2"),
        ([":Limit:Rate p,1,4000"], "2"),
        ([":Limit:Acceleration p,1,0"], "2"),
        (["*RST"], "1"),
        ([":Mode:Off"], "1"),
    ],
)
def test_what_is_refused_stands_in_the_ecp_until_it_is_read(table, messages, code):
    for message in messages:
        table.receive(message)
    assert table.at(1).rate_dps == 0.0
    assert ecp(table) == code
    assert ecp(table) == "0"
    assert len(table.refusals) == 1


def test_an_error_of_one_axis_is_not_told_by_another(table):
    table.receive(READY + ";:Mode:Position 2;:Demand:Position 2,120")
    assert (ecp(table, 1), ecp(table, 2)) == ("0", "2")


def test_a_frame_that_is_not_understood_is_not_done_at_all(table):
    table.receive(READY)
    table.receive(":Mode:Rate 1;:Demand:Rate 1,50;:Nonsense 1")
    assert table.mode(1) == "off"


def test_off_is_servoed_to_zero_rate(table, clock):
    table.receive(READY + ";:Mode:Rate 1;:Demand:Rate 1,50")
    clock.sleep(10.0)
    assert table.receive(":Read:Rate? 1") == "50.0000"
    table.receive(":Mode:Off ALL")
    clock.sleep(1.0)
    held = table.receive(":Read:Position? 1;:Read:Rate? 1")
    clock.sleep(1000.0)
    assert table.receive(":READ:POS? 1;:read:rate? 1") == held
    assert held.endswith(";0.0000")


def test_a_command_twice_is_a_command_once(table, clock):
    table.receive(READY)
    for _ in range(2):
        table.receive(":Mode:Position 1;:Demand:Position 1,270")
        clock.sleep(5.0)
        assert table.receive(":Read:Position? 1") == "270.0000"
    assert table.at(1).position_deg == pytest.approx(-90.0)


def test_a_stuck_axis_stays_where_it_is(table, clock):
    table.receive(READY + ";:Mode:Rate 1;:Demand:Rate 1,50")
    clock.sleep(10.0)
    table.seize()
    here = table.at(1).position_deg
    table.receive(":Mode:Position 1;:Demand:Position 1,0")
    clock.sleep(100.0)
    assert table.at(1) == (here, 0.0)
