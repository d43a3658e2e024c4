"""What every registered part must do, kind by kind: functions ``check_…(part)``, and the tests that call them."""
