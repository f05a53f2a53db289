"""Tests of measures of the gap."""
