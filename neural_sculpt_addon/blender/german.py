# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in German: every text that `tests/blender/test_translations.py` finds."""

TEXTS = {
    # worker and device
    "Not started": "Nicht gestartet",
    "Ready on {}": "Bereit auf {}",
    "No such device": "Das Gerät fehlt",
    "Starting": "Startet",
    "Stopped unexpectedly": "Unerwartet beendet",
    "Not responding": "Reagiert nicht",
    "The worker gives no sign of life": "Der Arbeitsprozess gibt kein Lebenszeichen",
    "Restart": "Neu starten",
    "The worker gives no sign of life. Restart it: no stroke is lost, the one that it was at is"
    " computed again.": "Der Arbeitsprozess gibt kein Lebenszeichen. Ihn neu starten: Kein Strich"
    " geht verloren, der gerade berechnete wird noch einmal berechnet.",
    "Device": "Gerät",
    "What strokes are sculpted on": "Worauf Striche berechnet werden",
    "Auto": "Automatisch",
    "A CUDA graphics card where that works, or the processor": "Eine CUDA-Grafikkarte, wo das"
    " geht, sonst der Prozessor",
    "CPU": "CPU",
    "The processor": "Der Prozessor",
    "CUDA": "CUDA",
    "An NVIDIA graphics card, by a PyTorch made for CUDA": "Eine NVIDIA-Grafikkarte, mit einem"
    " PyTorch für CUDA",
    # model
    "{} in Blender": "{} in Blender",
    "{} in the worker while it is meshed": "{} im Arbeitsprozess, solange er es vernetzt",
    "A box as a neural field": "Ein Quader als neuronales Feld",
    "A capsule as a neural field": "Eine Kapsel als neuronales Feld",
    "A network from a .safetensors or .pth file": "Ein Netz aus einer .safetensors-"
    " oder .pth-Datei",
    "A .safetensors or .pth file": "Eine .safetensors- oder .pth-Datei",
    "A sphere as a neural field": "Eine Kugel als neuronales Feld",
    "A suzanne as a neural field": "Suzanne als neuronales Feld",
    "A torus as a neural field": "Ein Torus als neuronales Feld",
    "About {} triangles": "Etwa {} Dreiecke",
    "Absorb": "Aufnehmen",
    "Add Neural Field": "Neuronales Feld hinzufügen",
    "Add a neural field at the 3D cursor": "Ein neuronales Feld am 3D-Cursor hinzufügen",
    "As large as those of the paper": "So groß wie die des Artikels",
    "Box": "Quader",
    "Capsule": "Kapsel",
    "Cells along an edge of the box in which the proxy of a new field is meshed": "Zellen an einer"
    " Kante des Würfels, in dem der Proxy eines neuen Feldes vernetzt wird",
    "Cells along an edge of the field's box": "Zellen an einer Kante des Würfels um das Feld",
    "Cells along an edge of the field's box, for a mesh or a level set": "Zellen an einer Kante des"
    " Würfels um das Feld, für ein Mesh oder ein Level-Set",
    "Cells along an edge of the field's box in which the proxy is meshed": "Zellen an einer Kante"
    " des Würfels um das Feld, in denen der Proxy vernetzt wird",
    "Distance from the mesh": "Abstand vom Mesh",
    "Distance from the mesh, 95 %": "Abstand vom Mesh, 95 %",
    "Distance from the mesh, largest": "Abstand vom Mesh, größter",
    "Draft": "Entwurf",
    "Drift": "Drift",
    "Export Neural Field": "Neuronales Feld exportieren",
    "Export the active neural field as a network, a mesh or a level set": "Das aktive neuronale"
    " Feld als Netz, als Mesh oder als Level-Set exportieren",
    "File": "Datei",
    "Fine": "Fein",
    "Fit a neural field to the active mesh": "Ein neuronales Feld an das aktive Mesh anpassen",
    "Neural Boolean": "Neuronaler Boolean",
    "Unite the active field with the other selected field or mesh, or cut it by that": "Das aktive"
    " Feld mit dem anderen ausgewählten Feld oder Mesh vereinigen oder damit schneiden",
    "Operation": "Operation",
    "What is made of both": "Was aus beiden wird",
    "Union": "Vereinigung",
    "Difference": "Differenz",
    "Intersection": "Schnittmenge",
    "Both together": "Beide zusammen",
    "The field without the other object": "Das Feld ohne das andere Objekt",
    "What lies in both": "Was in beiden liegt",
    "Blend": "Übergang",
    "Radius in which both flow into each other; 0 leaves a crease": "Radius, in dem beide"
    " ineinander übergehen; 0 lässt eine Kante",
    "Union with {}": "Vereinigung mit {}",
    "Difference from {}": "Differenz zu {}",
    "Intersection with {}": "Schnittmenge mit {}",
    "Leave this mode for Object Mode first": "Zuerst in den Objektmodus wechseln",
    "Booleans add detail. Choose Detail in the panel Model first": "Boolesche Operationen fügen"
    " Einzelheiten hinzu. Zuerst im Bereich Modell Einzelheiten wählen",
    "Select another field or mesh, and the field last": "Ein anderes Feld oder Mesh auswählen, das"
    " Feld zuletzt",
    "Take what other brushes did to the proxy into the field and its history": "Was andere Pinsel"
    " mit dem Proxy gemacht haben, ins Feld und seinen Verlauf aufnehmen",
    "Absorbing adds detail. Choose Detail in the panel Model first": "Aufnehmen fügt Einzelheiten"
    " hinzu. Zuerst im Bereich Modell Einzelheiten wählen",
    "Choose what strokes change: detail, which keeps them where they are, or the network": "Wählen,"
    " was Striche ändern: Einzelheiten, dann bleiben sie, wo sie sind, oder das Netz",
    "Consolidate": "Verdichten",
    "Detail": "Einzelheiten",
    "Each stroke adds detail of its own and leaves all else as it is": "Jeder Strich fügt eigene"
    " Einzelheiten hinzu und lässt alles andere, wie es ist",
    "Fit a network without detail to the field, which loses some of it. The strokes become part of"
    " the base": "Ein Netz ohne Einzelheiten an das Feld anpassen, wobei ein Teil verloren geht."
    " Die Striche werden Teil der Grundlage",
    "Height reached": "Erreichte Höhe",
    "Lost by consolidating": "Beim Verdichten verloren",
    "Lost by consolidating, 95 %": "Beim Verdichten verloren, 95 %",
    "Measuring...": "Messen...",
    "Sculpt": "Modellieren",
    "Sculpt Detail or Network": "Einzelheiten oder Netz modellieren",
    "Strokes change the weights of the network: a small field, for tools that read .pth files."
    " Slower and less exact": "Striche ändern die Gewichte des Netzes: ein kleines Feld, für"
    " Werkzeuge, die .pth-Dateien lesen. Langsamer und ungenauer",
    "This field has detail, which a network cannot hold. Consolidate it first.": "Dieses Feld hat"
    " Einzelheiten, die ein Netz nicht halten kann. Es zuerst verdichten.",
    "Untouched normals off by": "Unberührte Normalen weichen ab um",
    "Way back, 95 %": "Rückweg, 95 %",
    "What strokes change": "Was Striche ändern",
    "Wait for the end of a drag": "Auf das Ende des Ziehens warten",
    "Watch Release": "Loslassen abwarten",
    "Width": "Breite",
    "From File": "Aus Datei",
    "Good Enough": "Gut genug",
    "Good enough to sculpt on": "Gut genug zum Modellieren",
    "How close to the mesh, and how long it takes": "Wie nah am Mesh, und wie lange es dauert",
    "Kind": "Art",
    "Large and slow": "Groß und langsam",
    "Makes solids of the open parts of the mesh; 0 leaves them as they are": "Macht offene Teile"
    " des Meshs zu Körpern; 0 lässt sie, wie sie sind",
    "Smooth": "Glatt",
    "Shading": "Schattierung",
    "Shade the proxy by the normals of the field; otherwise triangles are seen": "Den Proxy mit den"
    " Normalen des Feldes schattieren; sonst sieht man Dreiecke",
    "Mesh the proxy of the active neural field again, finer or coarser, smooth or flat": "Den"
    " Proxy des aktiven neuronalen Feldes neu vernetzen, feiner oder gröber, glatt oder flach",
    "Model": "Modell",
    "Name": "Name",
    "Network": "Netz",
    "Network: .safetensors or .pth. Mesh: .obj, .ply, .stl, .glb or .gltf. OpenVDB level set"
    ": .vdb": "Netz: .safetensors oder .pth. Mesh: .obj, .ply, .stl, .glb oder .gltf. OpenVDB-"
    "Level-Set: .vdb",
    "Neural Field": "Neuronales Feld",
    "Neural Field from Mesh": "Neuronales Feld aus Mesh",
    "Neural Sculpt": "Neural Sculpt",
    "Normal": "Normal",
    "Normals off by": "Normalen weichen ab um",
    "Of all random numbers": "Aller Zufallszahlen",
    "Proxy": "Proxy",
    "Quality": "Qualität",
    "Quick and rough": "Schnell und grob",
    "Remesh Proxy": "Proxy neu vernetzen",
    "Resolution": "Auflösung",
    "Seed": "Startwert",
    "Separate pieces": "Getrennte Teile",
    "Size": "Größe",
    "Slow and close to the mesh": "Langsam und nah am Mesh",
    "Small and fast, for simple shapes": "Klein und schnell, für einfache Formen",
    "Source": "Quelle",
    "Show a message in the status bar": "Eine Nachricht in der Statusleiste zeigen",
    "Sphere": "Kugel",
    "Stop learning and take the field as it is now": "Das Lernen beenden und das Feld nehmen, wie"
    " es jetzt ist",
    "Stroke error": "Strichfehler",
    "Stroke error, 95 %": "Strichfehler, 95 %",
    "Suzanne": "Suzanne",
    "Pieces: {} before the last stroke, {} now": "Teile: {} vor dem letzten Strich, jetzt {}",
    "The last stroke was not fully reached": "Der letzte Strich wurde nicht ganz erreicht",
    "The proxy was sculpted by other brushes, which the field does not know of. Absorb takes that"
    " into the field, Remesh Proxy drops it.": "Der Proxy wurde mit anderen Pinseln bearbeitet,"
    " wovon das Feld nichts weiß. Aufnehmen bringt das ins Feld, Proxy neu vernetzen verwirft es.",
    "The proxy is as the field made it": "Der Proxy ist, wie das Feld ihn gemacht hat",
    "The proxy is as the field made it; there is nothing to absorb.": "Der Proxy ist, wie das Feld"
    " ihn gemacht hat; es gibt nichts aufzunehmen.",
    "This Blender has no OpenVDB for Python. Use Blender 4.5 or newer from blender.org, or export a"
    " mesh.": "Dieses Blender hat kein OpenVDB für Python. Blender 4.5 oder neuer von blender.org"
    " verwenden oder ein Mesh exportieren.",
    "Thickness": "Dicke",
    "Torus": "Torus",
    "Network: {} units": "Netz: {} Einheiten",
    "Sculpted by other brushes": "Mit anderen Pinseln bearbeitet",
    "What other brushes sculpted will be gone": "Was andere Pinsel modelliert haben, geht verloren",
    "Triangles": "Dreiecke",
    "Units in each of the network's two layers: more hold more and take longer": "Neuronen in"
    " jeder der beiden Schichten des Netzes: mehr halten mehr und brauchen länger",
    "Volume on the wrong side": "Volumen auf der falschen Seite",
    "What the field is made of": "Woraus das Feld gemacht wird",
    "What the field was made from": "Woraus das Feld entstand",
    "{}, from {}": "{}, aus {}",
    # brush
    "Brush": "Pinsel",
    "Brush Color": "Pinselfarbe",
    "Carve where the brush raises": "Vertiefen, wo der Pinsel erhöht",
    "Carving Color": "Farbe beim Vertiefen",
    "Central": "Mitte",
    "Change the radius or the intensity of the brush with the mouse": "Radius oder Stärke des"
    " Pinsels mit der Maus ändern",
    "Cross-section of the stroke": "Querschnitt des Strichs",
    "Cubic": "Kubisch",
    "Curve": "Kurve",
    "Exponential": "Exponentiell",
    "Factor": "Faktor",
    "Half width of the stroke": "Halbe Breite des Strichs",
    "Half width of the stroke, in model space": "Halbe Breite des Strichs, im Modellraum",
    "Half width of the stroke, on the active field": "Halbe Breite des Strichs, auf dem aktiven"
    " Feld",
    "Height of the stroke": "Höhe des Strichs",
    "Height of the stroke, in model space; negative carves": "Höhe des Strichs, im Modellraum;"
    " negativ vertieft",
    "Height of the stroke, on the active field; negative carves": "Höhe des Strichs, auf dem"
    " aktiven Feld; negativ vertieft",
    "Identity": "Gleichmäßig",
    "Instead of the brush's, in model space": "Anstelle dessen des Pinsels, im Modellraum",
    "Instead of the mouse": "Anstelle der Maus",
    "Intensity": "Stärke",
    "Intensity Factor": "Stärkefaktor",
    "Inverse Central": "Mitte umgekehrt",
    "Invert": "Umkehren",
    "Linear": "Linear",
    "Modulation": "Modulation",
    "Of a stroke where it carves": "Eines Strichs, wo er vertieft",
    "Of a stroke where it raises the surface": "Eines Strichs, wo er die Oberfläche erhöht",
    "Of the circle under the mouse": "Des Kreises unter der Maus",
    "Of the brush's intensity, at this point": "Der Stärke des Pinsels, an diesem Punkt",
    "Of the brush's radius, at this point": "Des Radius des Pinsels, an diesem Punkt",
    "Of the brush, which to change": "Welche des Pinsels geändert wird",
    "Pen Pressure": "Stiftdruck",
    "Pressure on Intensity": "Druck auf Stärke",
    "Pressure on Radius": "Druck auf Radius",
    "Profile": "Profil",
    "Quintic": "Quintisch",
    "Radius": "Radius",
    "Radius Factor": "Radiusfaktor",
    "Raising Color": "Farbe beim Erhöhen",
    "Resize Neural Brush": "Größe des neuronalen Pinsels",
    "Sinusoidal": "Sinusförmig",
    "Strength along the stroke": "Stärke entlang des Strichs",
    "The central modulation": "Die Modulation mit betonter Mitte",
    "The cubic profile": "Das kubische Profil",
    "The exponential modulation": "Die exponentielle Modulation",
    "The identity modulation": "Die gleichmäßige Modulation",
    "The inverse central modulation": "Die Modulation mit betonten Enden",
    "The linear modulation": "Die lineare Modulation",
    "The linear profile": "Das lineare Profil",
    "The modulation that the curve widget shows": "Die Modulation, die das Kurvenfeld zeigt",
    "The pen's pressure changes the intensity, by the curve": "Der Stiftdruck ändert die Stärke,"
    " nach der Kurve",
    "The pen's pressure changes the radius, by the curve": "Der Stiftdruck ändert den Radius, nach"
    " der Kurve",
    "The profile that the curve widget shows": "Das Profil, das das Kurvenfeld zeigt",
    "The quintic profile": "Das quintische Profil",
    "The sinusoidal modulation": "Die sinusförmige Modulation",
    # presets
    "A preset has one handle for each point, as Blender names them.": "Eine Vorlage hat einen Griff"
    " für jeden Punkt, wie Blender sie nennt.",
    "Add a preset from a file that somebody shared": "Eine Vorlage aus einer Datei hinzufügen, die"
    " jemand weitergegeben hat",
    "Beads": "Perlen",
    "Braid": "Zopf",
    "Chisel": "Meißel",
    "Crease": "Falte",
    "Delete Preset": "Vorlage löschen",
    "Delete a preset of your own": "Eine eigene Vorlage löschen",
    "Dent": "Delle",
    "Gem": "Edelstein",
    "Give a preset of your own another name": "Einer eigenen Vorlage einen anderen Namen geben",
    "A preset file that somebody shared": "Eine Vorlagendatei, die jemand weitergegeben hat",
    "Import Preset": "Vorlage importieren",
    "Load this preset into the curve widget": "Diese Vorlage in das Kurvenfeld laden",
    "Modulation Presets": "Modulationsvorlagen",
    "No presets of your own yet": "Noch keine eigenen Vorlagen",
    "Of the preset": "Der Vorlage",
    "One of your own": "Eine der eigenen",
    "Only a curve can be saved. Choose Curve and shape it first.": "Nur eine Kurve kann gespeichert"
    " werden. Zuerst Kurve wählen und formen.",
    "Open Preset Folder": "Vorlagenordner öffnen",
    "Open the folder of your own presets, whose files can be shared": "Den Ordner der eigenen"
    " Vorlagen öffnen, deren Dateien man weitergeben kann",
    "Open Log": "Protokoll öffnen",
    "Open the file in which the worker writes what it does": "Die Datei öffnen, in die der"
    " Arbeitsprozess schreibt, was er tut",
    "There is no log before the worker's first start": "Vor dem ersten Start des Arbeitsprozesses"
    " gibt es kein Protokoll",
    "Preset": "Vorlage",
    "Profile Presets": "Profilvorlagen",
    "Rename Preset": "Vorlage umbenennen",
    "Ridge": "Grat",
    "Save Preset": "Vorlage speichern",
    "Save what the curve widget shows as a preset": "Was das Kurvenfeld zeigt, als Vorlage"
    " speichern",
    "Scales": "Schuppen",
    "Seam": "Naht",
    "Stitches": "Stiche",
    "Taper": "Spitz",
    "The points of a preset must go from left to right.": "Die Punkte einer Vorlage müssen von"
    " links nach rechts gehen.",
    "There is no such preset. Save one first.": "Es gibt keine solche Vorlage. Zuerst eine"
    " speichern.",
    "This file is too large for a preset.": "Diese Datei ist zu groß für eine Vorlage.",
    # stroke
    "A freehand stroke, too, can be edited until Enter confirms it": "Auch ein freihändiger Strich"
    " kann bearbeitet werden, bis die Eingabetaste ihn bestätigt",
    "Across the plane x = 0": "An der Ebene x = 0",
    "Across the plane y = 0": "An der Ebene y = 0",
    "Across the plane z = 0": "An der Ebene z = 0",
    "Adjust": "Nachbearbeiten",
    "All points of a cross-section along the normal in its middle": "Alle Punkte eines Querschnitts"
    " entlang der Normale in seiner Mitte",
    "Along which normal the surface is displaced": "Entlang welcher Normale die Oberfläche"
    " verschoben wird",
    "Annotations": "Anmerkungen",
    "Axes across whose planes the stroke is repeated": "Achsen, an deren Ebenen der Strich"
    " gespiegelt wird",
    "Click control points": "Kontrollpunkte klicken",
    "Click control points and confirm with Enter": "Kontrollpunkte klicken und mit der Eingabetaste"
    " bestätigen",
    "Click or Enter: keep     Esc: as before": "Klick oder Eingabe: übernehmen     Esc: wie zuvor",
    "Click: add a point     Drag: move it     Backspace: remove it     Enter: sculpt"
    "     Esc: cancel": "Klick: Punkt setzen     Ziehen: verschieben     Rücktaste: entfernen"
    "     Eingabe: modellieren     Esc: abbrechen",
    "Direction": "Richtung",
    "Distance": "Abstand",
    "Distance between the control points of a freehand stroke, in radii": "Abstand der"
    " Kontrollpunkte eines freihändigen Strichs, in Radien",
    "Down": "Abwärts",
    "Draw Neural Stroke": "Neuronalen Strich zeichnen",
    "Draw Stroke": "Strich zeichnen",
    "Closed": "Geschlossen",
    "The end of the stroke joins its start": "Das Ende des Striches trifft seinen Anfang",
    "Keep what the pen's pressure made of the stroke": "Behalten, was der Druck des Stiftes aus dem"
    " Strich gemacht hat",
    "Edit Points": "Punkte bearbeiten",
    "Draw a stroke on the active neural field, or edit the points of one": "Einen"
    " Strich auf das aktive neuronale Feld zeichnen oder die Punkte eines Striches bearbeiten",
    "Draw on the field with the left mouse button     Esc: stop": "Mit der linken Maustaste auf das"
    " Feld zeichnen     Esc: beenden",
    "Each point along its own normal": "Jeder Punkt entlang seiner eigenen Normale",
    "Ends": "Enden",
    "Flat": "Flach",
    "Freehand": "Freihändig",
    "From Annotations": "Aus Anmerkungen",
    "From Selected Objects": "Aus ausgewählten Objekten",
    "Grease pencil, curves and hair curves; only their selected lines where some are": "Grease"
    " Pencil, Kurven und Haarkurven; nur ihre ausgewählten Linien, wo es welche gibt",
    "Hold the left mouse button and draw": "Die linke Maustaste halten und zeichnen",
    "How a stroke is drawn": "Wie ein Strich gezeichnet wird",
    "How far from the surface a line may be; what is farther away is left out": "Wie weit eine"
    " Linie von der Oberfläche entfernt sein darf; was weiter weg ist, wird ausgelassen",
    "How far the stroke lags behind the pen to smooth it, in radii; 0 follows it": "Wie weit der"
    " Strich dem Stift nachläuft, um glatter zu werden, in Radien; 0 folgt ihm genau",
    "Input": "Eingabe",
    "Length": "Länge",
    "Leave the object where it is": "Das Objekt lassen, wo es ist",
    "Location": "Ort",
    "Mirror": "Spiegeln",
    "Neural Stroke": "Neuronaler Strich",
    "No Drag": "Kein Ziehen",
    "No grease pencil, curve or hair is selected. Select some beside the field.": "Kein Grease"
    " Pencil, keine Kurve und kein Haar ist ausgewählt. Neben dem Feld welche auswählen.",
    "Of the stroke": "Des Strichs",
    "Point in model space, the object's local space": "Punkt im Modellraum, dem lokalen Raum des"
    " Objekts",
    "Points": "Punkte",
    "Release: sculpt the stroke     Esc: cancel": "Loslassen: Strich modellieren"
    "     Esc: abbrechen",
    "Round": "Rund",
    "Sculpt strokes along grease pencil, annotations, curves or hair near the active field. Their"
    " thickness acts as the pen's pressure": "Striche entlang von Grease Pencil, Anmerkungen,"
    " Kurven oder Haaren nahe dem aktiven Feld modellieren. Ihre Dicke wirkt als Stiftdruck",
    "Sculpt strokes that are given as points or as the text of a stroke file": "Striche"
    " modellieren, die als Punkte oder als Text einer Strichdatei gegeben sind",
    "Selected Objects": "Ausgewählte Objekte",
    "Spacing": "Abstand",
    "Stabilizer": "Stabilisator",
    "Stroke": "Strich",
    "Strokes": "Striche",
    "Strokes are drawn in a 3D viewport": "Striche werden in einer 3D-Ansicht gezeichnet",
    "Strokes from Lines": "Striche aus Linien",
    "Surface": "Oberfläche",
    "The lines are too far from the field. Raise the distance.": "Die Linien sind zu weit vom Feld"
    " entfernt. Den Abstand erhöhen.",
    "The profile goes around the ends": "Das Profil geht um die Enden herum",
    "The stroke file holds no strokes.": "Die Strichdatei enthält keine Striche.",
    "The stroke is cut off at its ends": "Der Strich ist an seinen Enden abgeschnitten",
    "There are no annotations on this frame. Draw some on the field first.": "Es gibt keine"
    " Anmerkungen in diesem Bild. Zuerst welche auf das Feld zeichnen.",
    "There is nothing to sculpt. Give points or a stroke file.": "Es gibt nichts zu modellieren."
    " Punkte oder eine Strichdatei angeben.",
    "Those of the scene": "Die der Szene",
    "Up": "Aufwärts",
    "What a stroke does beyond its first and last point": "Was ein Strich jenseits seines ersten"
    " und letzten Punktes tut",
    "Where the lines are": "Wo die Linien sind",
    "Where to": "Wohin",
    # history
    "The field's {} strokes become part of its base and leave the history.": "Die {} Striche des"
    " Feldes werden Teil seiner Grundlage und verlassen den Verlauf.",
    "All strokes since the base": "Alle Striche seit der Grundlage",
    "Apply the strokes to the base first, and delete muted ones": "Zuerst die Striche auf die"
    " Grundlage anwenden und stumme löschen",
    "Change how much of the stroke is in the field": "Ändern, wie viel vom Strich im Feld ist",
    "How much of the stroke is in the field": "Wie viel vom Strich im Feld ist",
    "Sculpted": "Modelliert",
    "Strength": "Wirkung",
    "Stroke Strength": "Wirkung des Strichs",
    "Apply the stroke earlier or later than its neighbor": "Den Strich früher oder später als"
    " seinen Nachbarn anwenden",
    "Apply the stroke once more, right after itself": "Den Strich noch einmal anwenden, gleich nach"
    " ihm selbst",
    "Apply to Base": "Auf Grundlage anwenden",
    "As It Is": "Wie es ist",
    "Change the settings of the stroke, wherever it stands in the list": "Die Einstellungen des"
    " Strichs ändern, wo auch immer er in der Liste steht",
    "Delete Stroke": "Strich löschen",
    "Duplicate Stroke": "Strich duplizieren",
    "Edit Stroke": "Strich bearbeiten",
    "History": "Verlauf",
    "Leave all other strokes out of the field, or take all in again": "Alle anderen Striche aus dem"
    " Feld herauslassen oder alle wieder aufnehmen",
    "Leave the stroke out of the field, or take it in again": "Den Strich aus dem Feld herauslassen"
    " oder wieder aufnehmen",
    "Move Stroke": "Strich verschieben",
    "Mute Stroke": "Strich stummschalten",
    "Muted": "Stumm",
    "Of the stroke; double-click to rename it": "Des Strichs; Doppelklick benennt ihn um",
    "One stroke earlier": "Einen Strich früher",
    "One stroke later": "Einen Strich später",
    "Remove the stroke from the field and from the list": "Den Strich aus dem Feld und aus der"
    " Liste entfernen",
    "Solo Stroke": "Strich solo",
    "Take all strokes that are not muted into the base of the field and off the list": "Alle nicht"
    " stummen Striche in die Grundlage des Feldes aufnehmen und aus der Liste entfernen",
    "The modulation that the stroke was drawn with": "Die Modulation, mit der der Strich gezeichnet"
    " wurde",
    "The profile that the stroke was drawn with": "Das Profil, mit dem der Strich gezeichnet wurde",
    "The stroke is left out of the field": "Der Strich ist aus dem Feld herausgelassen",
    "The stroke is no longer in the list. Choose another one.": "Der Strich ist nicht mehr in der"
    " Liste. Einen anderen wählen.",
    "This field has no strokes yet": "Dieses Feld hat noch keine Striche",
    # worker
    "1.5 GB on disk, in a folder of their own:": "1,5 GB auf der Platte, in einem eigenen Ordner:",
    "Its packages are downloaded from the Python Package Index: about 300 MB,": "Seine Pakete"
    " werden vom Python Package Index geladen: etwa 300 MB,",
    "Neural Sculpt computes in a separate process with PyTorch.": "Neural Sculpt rechnet in einem"
    " eigenen Prozess mit PyTorch.",
    "A Python with PyTorch that runs the worker; empty for the installed one": "Ein Python mit"
    " PyTorch, das den Arbeitsprozess ausführt; leer für das installierte",
    "Cancel": "Abbrechen",
    "Cancel Installation": "Installation abbrechen",
    "Cancel the running job and all that wait for it; the fields stay as they are": "Die laufende"
    " Arbeit und alle, die auf sie warten, abbrechen; die Felder bleiben, wie sie sind",
    "Download PyTorch into a folder of its own; nothing of Blender's is changed": "PyTorch in einen"
    " eigenen Ordner laden; an Blender wird nichts verändert",
    "Install Worker": "Arbeitsprozess installieren",
    "Leave Edit Mode first": "Zuerst den Bearbeitungsmodus verlassen",
    "No mesh is becoming a field": "Kein Mesh wird gerade zum Feld",
    "Restart Worker": "Arbeitsprozess neu starten",
    "Select a mesh object first": "Zuerst ein Mesh-Objekt auswählen",
    "Select a neural field first": "Zuerst ein neuronales Feld auswählen",
    "Select a neural field first.": "Zuerst ein neuronales Feld auswählen.",
    "Stop the installation of the worker": "Die Installation des Arbeitsprozesses abbrechen",
    "Stop the worker, cancel its jobs and start it again; the fields stay as they are": "Den"
    " Arbeitsprozess anhalten, seine Arbeiten abbrechen und ihn neu starten; die Felder bleiben,"
    " wie sie sind",
    "The worker is being installed": "Der Arbeitsprozess wird installiert",
    "Stop Worker": "Arbeitsprozess anhalten",
    "Stop the worker and cancel its jobs. That frees its memory and the graphics card; the next"
    " stroke starts it again": "Den Arbeitsprozess anhalten und seine Arbeiten abbrechen. Das gibt"
    " seinen Speicher und die Grafikkarte frei; der nächste Strich startet ihn wieder",
    "The worker is not running": "Der Arbeitsprozess läuft nicht",
    "The worker is idle": "Der Arbeitsprozess ist untätig",
    "The worker still changes this field": "Der Arbeitsprozess ändert dieses Feld noch",
    "Turn on Allow Online Access in Preferences, System first": "Zuerst Onlinezugriff erlauben in"
    " Einstellungen, System einschalten",
    "Turn on Allow Online Access in Preferences, System first.": "Zuerst Onlinezugriff erlauben in"
    " Einstellungen, System einschalten.",
    "Worker": "Arbeitsprozess",
    "Worker Python": "Python des Arbeitsprozesses",
    "{} waiting": "{} in der Warteschlange",
}
