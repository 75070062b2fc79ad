PRAGMA application_id = 1280526402;
PRAGMA user_version = 1;
BEGIN TRANSACTION;
CREATE TABLE events (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            time TEXT NOT NULL,
            kind TEXT NOT NULL,
            text TEXT NOT NULL,
            data TEXT NOT NULL);
INSERT INTO "events" VALUES(1,1,'2026-11-21T04:00:13.694301+00:00','stop','operator asked','{"points": 7}');
CREATE TABLE instruments (
            id INTEGER PRIMARY KEY,
            maker TEXT NOT NULL,
            model TEXT NOT NULL,
            serial TEXT NOT NULL,
            revision TEXT NOT NULL,
            options TEXT NOT NULL,
            simulated INTEGER NOT NULL,
            UNIQUE (maker, model, serial, revision, options, simulated));
INSERT INTO "instruments" VALUES(1,'HEWLETT-PACKARD','35670A','MY42509215','A.01.11','["1D2", "AY6"]',0);
CREATE TABLE measurements (
            id INTEGER PRIMARY KEY AUTOINCREMENT,
            unit_id INTEGER NOT NULL REFERENCES units (id),
            plan_id INTEGER NOT NULL REFERENCES plans (id),
            instrument_id INTEGER REFERENCES instruments (id),
            address TEXT NOT NULL,
            state TEXT NOT NULL CHECK (state IN ('complete', 'interrupted', 'aborted')),
            source_state TEXT NOT NULL,
            started TEXT NOT NULL,
            ended TEXT,
            software TEXT NOT NULL,
            operator TEXT NOT NULL,
            notes TEXT NOT NULL,
            configurations TEXT NOT NULL,
            readback TEXT NOT NULL);
INSERT INTO "measurements" VALUES(1,1,1,1,'prologix:/dev/ttyUSB0?addr=11','complete','confirmed-off','2026-11-21T04:00:13.684094+00:00','2026-11-21T04:00:13.695113+00:00','lashbench 0.1.0','Operator A','first light','{"unit": "name = ''ADSS''\n"}','{"SWE:STIM": "5 CYCLE"}');
INSERT INTO "measurements" VALUES(2,2,1,NULL,'sim:','interrupted','unknown','2026-11-21T04:00:13.696276+00:00',NULL,'lashbench 0.1.0','','','{}','{}');
CREATE TABLE plans (
            id INTEGER PRIMARY KEY,
            document TEXT NOT NULL UNIQUE);
INSERT INTO "plans" VALUES(1,'{"dc_offset_v": 0.0, "direction": "up", "frequencies_hz": [100.0, 110.5, 125.0], "from_rest": false, "integrate_cycles": 7, "levels_vpk": [1.5, 2.5], "settle_cycles": 5}');
CREATE TABLE points (
            id INTEGER PRIMARY KEY,
            measurement_id INTEGER NOT NULL REFERENCES measurements (id),
            source_vpk REAL NOT NULL,
            requested_hz REAL NOT NULL,
            frequency_hz REAL NOT NULL,
            gain_re REAL,
            gain_im REAL,
            gain_std_db REAL,
            phase_std_deg REAL,
            variance_1 REAL,
            variance_2 REAL,
            flags INTEGER NOT NULL,
            detail TEXT NOT NULL,
            taken TEXT NOT NULL,
            superseded_by INTEGER REFERENCES points (id) DEFERRABLE INITIALLY DEFERRED);
INSERT INTO "points" VALUES(1,1,1.5,100.0,100.0,1.50000000000000022204e-01,-1.0,0.05,0.3,0.0001,0.0002,0,'{"range_vpk": 1.0}','2026-11-21T04:00:13.688245+00:00',NULL);
INSERT INTO "points" VALUES(2,1,1.5,110.5,110.5,1.50000000000000022204e-01,-1.105,0.05,0.3,0.0001,0.0002,0,'{"range_vpk": 1.0}','2026-11-21T04:00:13.689830+00:00',7);
INSERT INTO "points" VALUES(3,1,1.5,125.0,125.0,1.50000000000000022204e-01,-1.25,0.05,0.3,0.0001,0.0002,0,'{"range_vpk": 1.0}','2026-11-21T04:00:13.690566+00:00',NULL);
INSERT INTO "points" VALUES(4,1,2.5,100.0,100.0,0.25,-1.0,0.05,0.3,0.0001,0.0002,0,'{"range_vpk": 1.0}','2026-11-21T04:00:13.691241+00:00',NULL);
INSERT INTO "points" VALUES(5,1,2.5,110.5,110.5,0.25,-1.105,0.05,0.3,0.0001,0.0002,0,'{"range_vpk": 1.0}','2026-11-21T04:00:13.691877+00:00',NULL);
INSERT INTO "points" VALUES(6,1,2.5,125.0,125.0,0.25,-1.25,0.05,0.3,0.0001,0.0002,0,'{"range_vpk": 1.0}','2026-11-21T04:00:13.692531+00:00',NULL);
INSERT INTO "points" VALUES(7,1,1.5,110.5,110.5,0.25,-0.5,NULL,NULL,NULL,NULL,9,'{}','2026-11-21T04:00:13.693176+00:00',NULL);
CREATE TABLE units (
            id INTEGER PRIMARY KEY,
            name TEXT NOT NULL,
            serial TEXT NOT NULL,
            UNIQUE (name, serial));
INSERT INTO "units" VALUES(1,'ADSS','SN-7');
INSERT INTO "units" VALUES(2,'EDSS','');
CREATE UNIQUE INDEX points_live
            ON points (measurement_id, source_vpk, requested_hz) WHERE superseded_by IS NULL;
CREATE INDEX events_of ON events (measurement_id);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('measurements',2);
COMMIT;
